// What the sensor programs compute: access points of a WiFi scan, iron of a magnetometer.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "field_core/errors.hpp"
#include "field_core/random.hpp"
#include "field_ros/ellipsoid_fit.hpp"
#include "field_ros/wifi_scan.hpp"
#include "test_support.hpp"

namespace {

using namespace field_ros;
using field_ros_test::error_of;

// As iw 5.19 prints it, shortened.
constexpr const char* kScan =
    "BSS 3C:37:86:00:00:01(on wlan0) -- associated\n"
    "\tlast seen: 1234.567s [boottime]\n"
    "\tTSF: 1187652378 usec (0d, 00:19:47)\n"
    "\tfreq: 2437\n"
    "\tbeacon interval: 100 TUs\n"
    "\tsignal: -47.00 dBm\n"
    "\tSSID: hall\n"
    "\tBSS Load:\n"
    "\t\t * station count: 3\n"
    "BSS 3c:37:86:00:00:02(on wlan0)\n"
    "\tfreq: 5180.0\n"
    "\tsignal: -71.50 dBm\n"
    "\tSSID: \n"
    "BSS 3c:37:86:00:00:03(on wlan0)\n"
    "\tfreq: 2412\n"
    "\tSSID: without a signal\n"
    "BSS 3c:37:86:00:00:01(on wlan0)\n"
    "\tsignal: -60.00 dBm\n";

TEST(WifiScan, AccessPointsWithASignalAreRead) {
  const auto scan = parse_iw_scan(kScan);
  ASSERT_EQ(3u, scan.size());
  EXPECT_EQ("3c:37:86:00:00:01", scan[0].bssid);
  EXPECT_EQ("hall", scan[0].ssid);
  EXPECT_EQ(2437.0, scan[0].frequency_mhz);
  EXPECT_EQ(-47.0, scan[0].signal_dbm);
  EXPECT_EQ("", scan[1].ssid);
  EXPECT_EQ(5180.0, scan[1].frequency_mhz);
  EXPECT_TRUE(parse_iw_scan("").empty());
  EXPECT_TRUE(parse_iw_scan("command failed: Operation not permitted (-1)\n").empty());
  EXPECT_TRUE(parse_iw_scan("BSS Load:\n\tsignal: -3 dBm\n").empty());
}

TEST(WifiScan, AMeasurementHasEachAccessPointOnce) {
  const auto scan = parse_iw_scan(kScan);
  auto m = to_field(scan, {}, false);
  EXPECT_EQ((std::vector<std::string>{"ap_3c3786000001", "ap_3c3786000002"}), m.names);
  EXPECT_EQ((std::vector<double>{-47.0, -71.5}), m.values) << "of two the stronger";
  m = to_field(scan, {{"3c:37:86:00:00:02", "kitchen"}}, true);
  EXPECT_EQ((std::vector<std::string>{"kitchen"}), m.names);
}

// Readings of a field of 48 uT under known iron, in random attitudes.
struct Distorted {
  Eigen::Vector3d offset{12e-6, -30e-6, 7e-6};
  Eigen::Matrix3d iron;
  Eigen::Matrix3Xd readings;

  explicit Distorted(int n, bool planar, double noise = 0.0) {
    iron << 1.2, 0.1, 0.05, 0.1, 0.9, -0.08, 0.05, -0.08, 1.0;
    if (planar) iron = iron.cwiseProduct(Eigen::Matrix3d::Identity());
    field_core::Random random(7);
    readings.resize(3, n);
    for (int i = 0; i < n; ++i) {
      Eigen::Vector3d direction(random.normal(), random.normal(), random.normal());
      if (planar) direction.z() = 0.0;
      Eigen::Vector3d field = 48e-6 * direction.normalized();
      if (planar) field.z() = 40e-6;
      readings.col(i) = iron.inverse() * field + offset +
                        noise * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    }
  }
};

TEST(EllipsoidFit, KnownIronIsFoundExactly) {
  const Distorted d(200, false);
  const auto c = fit_ellipsoid(d.readings);
  EXPECT_TRUE(c.offset.isApprox(d.offset, 1e-9)) << c.offset.transpose();
  // Soft iron is known up to the magnitude, which no magnetometer can tell from it.
  EXPECT_TRUE(c.matrix.isApprox(d.iron / std::cbrt(d.iron.determinant()), 1e-9)) << c.matrix;
  EXPECT_LT(c.residual, 1e-14);
  EXPECT_NEAR(48e-6 / std::cbrt(d.iron.determinant()), c.field, 1e-12);
  EXPECT_GT(c.raw_residual, 5e-6);
}

TEST(EllipsoidFit, NoiseLeavesItsOwnSizeOnly) {
  const Distorted d(2000, false, 0.5e-6);
  const auto c = fit_ellipsoid(d.readings);
  // The offset of 2000 readings: about 0.5 uT sqrt(3 / 2000) = 0.02 uT; four of them.
  EXPECT_LT((c.offset - d.offset).norm(), 0.1e-6);
  EXPECT_GT(c.residual, 0.4e-6);
  EXPECT_LT(c.residual, 0.65e-6);
}

TEST(EllipsoidFit, OnAFloorTheEllipseIsFound) {
  const Distorted d(100, true);
  const auto c = fit_ellipse(d.readings);
  EXPECT_TRUE(c.offset.head<2>().isApprox(d.offset.head<2>(), 1e-9));
  EXPECT_NEAR(std::sqrt(1.2 / 0.9), c.matrix(0, 0), 1e-9);
  EXPECT_NEAR(std::sqrt(0.9 / 1.2), c.matrix(1, 1), 1e-9);
  EXPECT_EQ(0.0, c.offset.z());
  EXPECT_EQ(1.0, c.matrix(2, 2));
}

TEST(EllipsoidFit, ReadingsThatDoNotDetermineItAreRefused) {
  const Distorted floor(100, true);
  EXPECT_NE(std::string::npos,
            error_of([&] { fit_ellipsoid(floor.readings); }).find("all three axes"));
  EXPECT_NE(std::string::npos,
            error_of([&] { fit_ellipsoid(Distorted(8, false).readings); }).find("at least 9"));
  EXPECT_NE("", error_of([] { fit_ellipse(Eigen::Matrix3Xd::Constant(3, 20, 1e-5)); }));
  EXPECT_NE("", error_of([] { fit_ellipse(Eigen::Matrix3Xd(3, 0)); }));
}

}  // namespace
