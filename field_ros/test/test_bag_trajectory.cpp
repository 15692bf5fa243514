// The program bag_trajectory: its tables and exit codes.
#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/TransformStamped.h>
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <sys/wait.h>

#include <algorithm>

#include "test_support.hpp"

namespace {

using field_core::SE2;
using field_ros_test::TemporaryDirectory;

struct Outcome {
  int code;
  std::string out, err;
};

Outcome run(const TemporaryDirectory& directory, const std::string& arguments) {
  const std::string out = directory / "out", err = directory / "err";
  const std::string command =
      std::string(BAG_TRAJECTORY) + " " + arguments + " > '" + out + "' 2> '" + err + "'";
  const int status = std::system(command.c_str());
  return {WEXITSTATUS(status), field_ros_test::read_file(out), field_ros_test::read_file(err)};
}

TEST(BagTrajectory, PrintsEveryTypeOfPose) {
  const TemporaryDirectory directory;
  const std::string path = directory / "run.bag";
  {
    rosbag::Bag bag(path, rosbag::bagmode::Write);
    const ros::Time time(12, 250000000);
    bag.write("/odom", time, field_ros_test::odometry(12.25, 1.5, -2.0));
    geometry_msgs::PoseStamped pose;
    pose.header.stamp = time;
    pose.pose = field_ros::to_pose(SE2(1.5, -2.0, 0.0));
    bag.write("/pose", time, pose);
    geometry_msgs::TransformStamped transform;
    transform.header.stamp = time;
    transform.transform = field_ros::to_transform(SE2(1.5, -2.0, 0.0));
    bag.write("/transform", time, transform);
    geometry_msgs::PoseWithCovarianceStamped covariance;
    covariance.header.stamp = time;
    covariance.pose.pose = pose.pose;
    field_ros::set_covariance((Eigen::Matrix3d() << 1, 2, 3, 2, 5, 6, 3, 6, 9).finished(),
                              covariance.pose.covariance);
    bag.write("/estimate", time, covariance);
  }
  for (const char* topic : {"/odom", "/pose", "/transform"}) {
    const Outcome outcome = run(directory, "'" + path + "' " + topic);
    EXPECT_EQ(0, outcome.code) << outcome.err;
    EXPECT_EQ("stamp_s,x_m,y_m,yaw_rad\n12.250000000,1.5,-2,0\n", outcome.out) << topic;
  }
  EXPECT_EQ(
      "stamp_s,x_m,y_m,yaw_rad,cov_xx,cov_xy,cov_xa,cov_yy,cov_ya,cov_aa\n"
      "12.250000000,1.5,-2,0,1,2,3,5,6,9\n",
      run(directory, "'" + path + "' /estimate").out);
  const Outcome missing = run(directory, "'" + path + "' /none");
  EXPECT_EQ(1, missing.code);
  EXPECT_EQ("", missing.out);
  EXPECT_NE(std::string::npos, missing.err.find("there is no topic '/none'"));
}

TEST(BagTrajectory, ExitCodes) {
  const TemporaryDirectory directory;
  EXPECT_EQ(0, run(directory, "--help").code);
  EXPECT_EQ(2, run(directory, "only_a_bag").code);
  const Outcome missing = run(directory, "missing.bag /odom");
  EXPECT_EQ(1, missing.code);
  EXPECT_EQ(1, std::count(missing.err.begin(), missing.err.end(), '\n'));
}

}  // namespace
