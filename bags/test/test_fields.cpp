// The simulated fields against formulas worked out by hand.
#include <gtest/gtest.h>

#include <cmath>

#include "field_bags/beacons.hpp"
#include "field_bags/gp_field.hpp"
#include "field_bags/magnetic.hpp"
#include "field_bags/wifi.hpp"

namespace field_bags {
namespace {

using Eigen::Vector2d;
using field_core::SE2;

std::vector<double> read(const FieldSource& source, const SE2& sensor) {
  std::vector<double> values;
  source.append(sensor, values);
  EXPECT_EQ(values.size(), source.channels().size());
  return values;
}

/// Correlations of Rasmussen and Williams (2006), chapter 4, written out.
double expected_correlation(field_core::KernelType type, double r) {
  if (type == field_core::KernelType::squared_exponential) return std::exp(-0.5 * r * r);
  if (type == field_core::KernelType::matern32) {
    return (1 + std::sqrt(3.0) * r) * std::exp(-std::sqrt(3.0) * r);
  }
  return (1 + std::sqrt(5.0) * r + 5.0 / 3.0 * r * r) * std::exp(-std::sqrt(5.0) * r);
}

class GpDraws : public ::testing::TestWithParam<field_core::KernelType> {};

TEST_P(GpDraws, HaveTheKernelsCovariance) {
  const field_core::Kernel kernel(GetParam(), 3.0, {2.0, 0.5});
  const Vector2d a(0.3, -1.0);
  const std::vector<Vector2d> others{a, a + Vector2d(1.0, 0.0), a + Vector2d(0.0, 0.4),
                                     a + Vector2d(1.6, 0.6)};
  constexpr int kDraws = 6000;
  std::vector<double> sums(others.size(), 0.0);
  double mean = 0.0;
  field_core::Random random(7);
  for (int i = 0; i < kDraws; ++i) {
    const GpDraw draw(kernel, random, 40);
    const double value = draw(a);
    mean += value / kDraws;
    for (std::size_t k = 0; k < others.size(); ++k) sums[k] += value * draw(others[k]) / kDraws;
  }
  // The product of two standard normals has a standard deviation of at most sqrt(2): 4.5 sigma.
  const double tolerance = 4.5 * 9.0 * std::sqrt(2.0 / kDraws);
  EXPECT_NEAR(mean, 0.0, 4.5 * 3.0 / std::sqrt(kDraws));
  for (std::size_t k = 0; k < others.size(); ++k) {
    const double r = (others[k] - a).cwiseQuotient(Vector2d(2.0, 0.5)).norm();
    EXPECT_NEAR(sums[k], 9.0 * expected_correlation(GetParam(), r), tolerance) << k;
  }
}
INSTANTIATE_TEST_SUITE_P(Kernels, GpDraws,
                         ::testing::Values(field_core::KernelType::squared_exponential,
                                           field_core::KernelType::matern32,
                                           field_core::KernelType::matern52));

TEST(GpFields, AreFixedInSpaceAndDependOnTheSeedOnly) {
  std::map<std::string, GpFieldParams> params;
  params["b"].mean = 100.0;
  params["a"].mean = -5.0;
  const GpFields fields(params, 3), again(params, 3), other(params, 4);
  EXPECT_EQ(fields.channels()[0].name, "a");
  const SE2 here(1.0, 2.0, 0.0), turned(1.0, 2.0, 2.5);
  EXPECT_EQ(read(fields, here), read(again, turned));
  EXPECT_NE(read(fields, here), read(other, here));
  EXPECT_NEAR(read(fields, here)[1], 100.0, 6.0);  // signal_stddev 1
}

TEST(Wifi, FollowsLogDistancePathLossAndWalls) {
  WifiParams params;
  params.access_points["ap"].power = -40.0;
  params.path_loss_exponent = 2.0;
  params.floor = -90.0;
  std::map<std::string, WallParams> walls;
  walls["glass"].points = {{5, -1}, {5, 1}, {6, 1}};
  walls["glass"].attenuation = 7.0;
  const AccessPoints wifi(params, walls, 1);
  EXPECT_NEAR(read(wifi, SE2(0, 10, 1))[0], -60.0, 1e-12);   // 20 dB per decade, no wall
  EXPECT_NEAR(read(wifi, SE2(10, 0, 0))[0], -67.0, 1e-12);   // one crossing
  EXPECT_NEAR(read(wifi, SE2(0.1, 0, 0))[0], -40.0, 1e-12);  // nearer than 1 m: as at 1 m
  EXPECT_EQ(wifi.channels()[0].floor, -90.0);
}

TEST(Wifi, CountsCrossingsOnceAtCorners) {
  WallParams box;
  box.points = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}, {-1, -1}};
  EXPECT_EQ(wall_crossings({0, 0}, {3, 0}, box), 1);
  EXPECT_EQ(wall_crossings({-3, 0.5}, {3, 0.2}, box), 2);
  EXPECT_EQ(wall_crossings({0, 0}, {0.5, 0.5}, box), 0);
  EXPECT_EQ(wall_crossings({0, 0}, {3, 3}, box), 1);  // exactly through a corner
  EXPECT_EQ(wall_crossings({3, 0}, {0, 0}, box), 1);
}

TEST(Wifi, ShadowingHasItsStandardDeviation) {
  WifiParams params;
  params.shadowing_stddev = 4.0;
  params.access_points["ap"].position = {0.0, 0.0};
  double squares = 0.0;
  constexpr int kSeeds = 400;
  for (int seed = 0; seed < kSeeds; ++seed) {
    const AccessPoints wifi(params, {}, seed);
    const double shadow = read(wifi, SE2(10, 0, 0))[0] - (-35.0 - 25.0);  // default power, exponent
    squares += shadow * shadow / kSeeds;
  }
  EXPECT_NEAR(squares, 16.0, 4.5 * 16.0 * std::sqrt(2.0 / kSeeds));
}

TEST(Beacons, SeeTheDirectionInTheSensorsFrame) {
  BeaconParams params;
  params.spots["s"].position = {1.0, 2.0};
  params.height = 2.0;
  params.offset = {0.1, -0.2};
  const Beacons beacons(params, {-5, -5, 5, 5});
  EXPECT_EQ(beacons.channels()[0].name, "s_x");
  EXPECT_EQ(beacons.channels()[1].name, "s_y");
  const auto seen =
      read(beacons, SE2(0, 0, M_PI / 2));  // the spot is to the right, ahead: (2, -1) / 2
  EXPECT_NEAR(seen[0], 1.0 + 0.1, 1e-12);
  EXPECT_NEAR(seen[1], -0.5 - 0.2, 1e-12);
}

TEST(Beacons, MultipathBendsTheSignalAtAWall) {
  BeaconParams params;
  params.spots["s"].position = {0.0, 0.0};
  params.height = 1.0;
  params.multipath = 0.5;
  params.multipath_length = 1.0;
  const Beacons beacons(params, {-1, -1, 1, 1});
  EXPECT_NEAR(beacons.direction({0, 0}, {0, 0}).norm(), 0.0, 1e-15);  // by symmetry
  // At (1, 0): direct light from x = -1, images at x = -3, -1, 1, -1 relative to the robot.
  const double far = 0.5 * std::exp(-2.0), side = 0.5 * std::exp(-1.0), near = 0.5;
  const double x = (-1 - 3 * far - side + near - side) / (1 + far + 2 * side + near);
  EXPECT_NEAR(beacons.direction({0, 0}, {1, 0}).x(), x, 1e-14);
  EXPECT_GT(x, -0.6);  // far from the -1 of a room without walls
}

TEST(Magnetic, DipoleOnItsAxisAndItsEquator) {
  MagneticParams params;
  params.earth_field = {0, 0, 0};
  params.dipoles["d"].position = {0, 0, 2};
  params.dipoles["d"].moment = {0, 0, 100};
  // mu0 / (4 pi) = 1e-7 T m / A: on the axis 2 m / r^3, on the equator -m / r^3.
  EXPECT_NEAR(MagneticDipoles(params).at({0, 0}).z(), 0.1 * 200 / 8, 1e-12);
  params.dipoles["d"].position = {0, 0, 0};
  const Eigen::Vector3d equator = MagneticDipoles(params).at({0, 2});
  EXPECT_NEAR(equator.z(), -0.1 * 100 / 8, 1e-12);
  EXPECT_NEAR(equator.head<2>().norm(), 0.0, 1e-12);
}

TEST(Magnetic, TurnsWithTheRobotExceptItsOwnIron) {
  MagneticParams params;
  params.earth_field = {20, 0, -40};
  params.offset = {1, 2, 3};
  params.dipoles["far"].position = {1e4, 0, 0};
  const MagneticDipoles field(params);
  const auto seen =
      read(field, SE2(0, 0, M_PI / 2));  // the robot looks west: north is to its right
  EXPECT_NEAR(seen[0], 0 + 1, 1e-9);
  EXPECT_NEAR(seen[1], -20 + 2, 1e-9);
  EXPECT_NEAR(seen[2], -40 + 3, 1e-9);
  EXPECT_NEAR(seen[3], std::sqrt(1 + 18 * 18 + 37 * 37), 1e-9);
}

}  // namespace
}  // namespace field_bags
