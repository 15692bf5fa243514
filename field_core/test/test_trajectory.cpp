#include <gtest/gtest.h>

#include <cmath>

#include "field_core/errors.hpp"
#include "field_core/random.hpp"
#include "field_core/trajectory.hpp"
#include "support.hpp"

namespace field_core {
namespace {

const char* const kThreePoses = "stamp_s,x_m,y_m,yaw_rad\n0,0,0,0\n1,2,0,0\n2,2,2,1.5\n";

TEST(Trajectory, ReadsCsvWithAndWithoutCovariance) {
  const test::TemporaryFolder folder;
  const auto plain = read_trajectory(folder.write("a.csv", kThreePoses));
  ASSERT_EQ(plain.size(), 3u);
  EXPECT_EQ(plain[2].pose.vector(), Eigen::Vector3d(2, 2, 1.5));
  EXPECT_FALSE(plain[0].covariance);
  const auto full = read_trajectory(folder.write(
      "b.csv", std::string(kEstimateCsvHeader) + "\n1,0,0,0,1,2,3,4,5,6\n2,0,0,0,,,,,,\n"));
  Eigen::Matrix3d expected;
  expected << 1, 2, 3, 2, 4, 5, 3, 5, 6;
  EXPECT_EQ(full[0].covariance.value(), expected);
  EXPECT_FALSE(full[1].covariance);
}

TEST(Trajectory, ReadsTum) {
  const test::TemporaryFolder folder;
  // Yaw 90 degrees, then 180; z and comments do not matter.
  const auto path = read_trajectory(folder.write(
      "a.tum",
      "# comment\n1600000000.25 1 2 9 0 0 0.70710678 0.70710678\r\n\n1600000001 0 0 0 0 0 1 0\n"));
  ASSERT_EQ(path.size(), 2u);
  EXPECT_EQ(path[0].stamp, Stamp(1600000000250000000));
  EXPECT_EQ(path[0].pose.translation(), Eigen::Vector2d(1, 2));
  EXPECT_NEAR(path[0].pose.yaw(), M_PI / 2, 1e-8);
  EXPECT_NEAR(std::abs(path[1].pose.yaw()), M_PI, 1e-15);
}

TEST(Trajectory, LinesRoundTrip) {
  const test::TemporaryFolder folder;
  Random random(50);
  std::string csv = std::string(kEstimateCsvHeader) + "\n", tum;
  Trajectory poses;
  for (int k = 0; k < 50; ++k) {
    Eigen::Matrix3d root;
    for (int i = 0; i < 9; ++i) root(i) = random.normal();
    const SE2 pose(random.normal(), random.normal(), random.uniform(-M_PI, M_PI));
    poses.push_back({Stamp(1600000000000000000 + 7 * k), pose, root * root.transpose()});
    csv += estimate_csv_line(poses[k].stamp, pose, *poses[k].covariance) + "\n";
    tum += tum_line(poses[k].stamp, pose) + "\n";
  }
  const auto from_csv = read_trajectory(folder.write("a.csv", csv));
  const auto from_tum = read_trajectory(folder.write("a.tum", tum));
  for (std::size_t k = 0; k < poses.size(); ++k) {
    EXPECT_EQ(from_csv[k].stamp, poses[k].stamp);
    EXPECT_EQ(from_csv[k].pose.vector(), poses[k].pose.vector());
    EXPECT_NEAR((*from_csv[k].covariance - *poses[k].covariance).norm(), 0.0, 1e-14);
    EXPECT_EQ(from_tum[k].stamp, poses[k].stamp);
    EXPECT_NEAR((from_tum[k].pose.vector() - poses[k].pose.vector()).norm(), 0.0, 1e-14);
  }
}

TEST(Trajectory, BadFilesAreRefusedByLine) {
  const test::TemporaryFolder folder;
  const auto reading = [&](const std::string& name, const std::string& content) {
    return [&folder, name, content] { read_trajectory(folder.write(name, content)); };
  };
  const std::string head = "stamp_s,x_m,y_m,yaw_rad\n";
  test::expect_error<DataError>(reading("a.csv", head), {"a.csv", "no pose"});
  test::expect_error<DataError>(reading("a.csv", "stamp_s,x_m,y_m\n0,0,0\n"), {"a.csv", "yaw_rad"});
  test::expect_error<DataError>(reading("a.csv", head + "0,0,0,0\n1,nan,0,0\n"),
                                {"a.csv:3", "x_m"});
  test::expect_error<DataError>(reading("a.csv", head + "1,0,0,0\n1,0,0,0\n"),
                                {"a.csv:3", "1.000000000", "not later"});
  test::expect_error<DataError>(reading("a.csv", "stamp_s,x_m,y_m,yaw_rad,cov_xx\n0,0,0,0,1\n"),
                                {"a.csv", "cov_xy"});
  test::expect_error<DataError>(
      reading("a.csv", std::string(kEstimateCsvHeader) + "\n0,0,0,0,1,,0,1,0,1\n"),
      {"a.csv:2", "cov_xy"});
  test::expect_error<DataError>(reading("a.tum", "0 0 0 0 0 0 1\n"), {"a.tum:1", "7 values", "qw"});
  test::expect_error<DataError>(reading("a.tum", "0 0 x 0 0 0 0 1\n"), {"a.tum:1", "'x'"});
  test::expect_error<DataError>(reading("a.tum", "# a\n0 0 0 0 0 0 0 0\n"),
                                {"a.tum:2", "quaternion"});
  test::expect_error<DataError>(reading("a.tum", "t 0 0 0 0 0 0 1\n"), {"a.tum:1", "'t'"});
  test::expect_error<DataError>(reading("a.tum", "# nothing\n"), {"a.tum", "no pose"});
  test::expect_error<DataError>(reading("a.txt", ""), {"a.txt", ".tum", ".csv"});
}

TEST(Trajectory, PoseAtInterpolatesInsideOnly) {
  const auto path = trajectory_from_csv(CsvTable::parse(kThreePoses, "t"));
  EXPECT_EQ(pose_at(path, Stamp(0))->vector(), Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(pose_at(path, Stamp(2000000000))->vector(), Eigen::Vector3d(2, 2, 1.5));
  EXPECT_NEAR((pose_at(path, Stamp(250000000))->vector() - Eigen::Vector3d(0.5, 0, 0)).norm(), 0.0,
              1e-14);
  EXPECT_FALSE(pose_at(path, Stamp(-1)));
  EXPECT_FALSE(pose_at(path, Stamp(2000000001)));
  EXPECT_FALSE(pose_at({}, Stamp(0)));
}

TEST(Trajectory, BetweenStampsIncludesTheEnds) {
  const auto path = trajectory_from_csv(CsvTable::parse(kThreePoses, "t"));
  EXPECT_EQ(between_stamps(path, Stamp(1000000000), Stamp(2000000000)).size(), 2u);
  EXPECT_TRUE(between_stamps(path, Stamp(3000000000), Stamp(4000000000)).empty());
}

}  // namespace
}  // namespace field_core
