#include "field_ros/bag_trajectory.hpp"

#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <geometry_msgs/TransformStamped.h>
#include <nav_msgs/Odometry.h>

#include "field_core/errors.hpp"
#include "field_ros/convert.hpp"

namespace field_ros {
namespace {

field_core::StampedPose pose_of(const rosbag::MessageInstance& instance) {
  if (const auto m = instance.instantiate<nav_msgs::Odometry>()) {
    return {from_ros(m->header.stamp), from_pose(m->pose.pose), {}};
  }
  if (const auto m = instance.instantiate<geometry_msgs::PoseStamped>()) {
    return {from_ros(m->header.stamp), from_pose(m->pose), {}};
  }
  if (const auto m = instance.instantiate<geometry_msgs::TransformStamped>()) {
    return {from_ros(m->header.stamp), from_transform(m->transform), {}};
  }
  if (const auto m = instance.instantiate<geometry_msgs::PoseWithCovarianceStamped>()) {
    return {from_ros(m->header.stamp), from_pose(m->pose.pose), get_covariance(m->pose.covariance)};
  }
  throw field_core::DataError("topic '" + instance.getTopic() + "': its " + instance.getDataType() +
                              " has another md5sum than this program's; try rosbag fix");
}

}  // namespace

const std::vector<std::string>& pose_types() {
  static const std::vector<std::string> types = {"nav_msgs/Odometry", "geometry_msgs/PoseStamped",
                                                 "geometry_msgs/PoseWithCovarianceStamped",
                                                 "geometry_msgs/TransformStamped"};
  return types;
}

field_core::Trajectory read_bag_trajectory(const BagInput& input, const std::string& topic) {
  input.require(topic, pose_types());
  field_core::Trajectory trajectory;
  input.read({topic}, [&trajectory](const rosbag::MessageInstance& instance, double) {
    trajectory.push_back(pose_of(instance));
  });
  return trajectory;
}

}  // namespace field_ros
