#include "messages.hpp"

#include <cmath>

#include "field_core/errors.hpp"

namespace field_bags {
namespace {

double rounded(double value) { return std::round(value * 1e9) * 1e-9; }

geometry_msgs::Quaternion quaternion(double yaw) {
  geometry_msgs::Quaternion q;
  q.z = rounded(std::sin(yaw / 2));
  q.w = rounded(std::cos(yaw / 2));
  return q;
}

geometry_msgs::Pose pose_message(const field_core::SE2& pose) {
  geometry_msgs::Pose message;
  message.position.x = pose.x();
  message.position.y = pose.y();
  message.orientation = quaternion(pose.yaw());
  return message;
}

}  // namespace

ros::Time to_ros(field_core::Stamp stamp) {
  const std::int64_t ns = stamp.count();
  constexpr std::int64_t kSecond = 1000000000, kEnd = 4294967296 * kSecond;
  if (ns < 0 || ns >= kEnd) {
    throw field_core::DataError("the stamp " + field_core::format_stamp(stamp) +
                                " s does not fit ROS time, 0 to 4294967295 s; shift the clock of "
                                "all logs by the same amount");
  }
  return ros::Time(static_cast<std::uint32_t>(ns / kSecond),
                   static_cast<std::uint32_t>(ns % kSecond));
}

nav_msgs::Odometry odometry_message(const std::string& prefix, const field_core::StampedPose& pose,
                                    const field_core::StampedPose* previous) {
  nav_msgs::Odometry message;
  message.header.stamp = to_ros(pose.stamp);
  message.header.frame_id = prefix + "odom";
  message.child_frame_id = prefix + "base_link";
  message.pose.pose = pose_message(pose.pose);
  if (previous) {
    const double seconds = field_core::to_seconds(pose.stamp - previous->stamp);
    const Eigen::Vector3d velocity = previous->pose.between(pose.pose).log() / seconds;
    const auto round4 = [](double v) { return std::round(v * 1e4) * 1e-4; };
    message.twist.twist.linear.x = round4(velocity.x());
    message.twist.twist.linear.y = round4(velocity.y());
    message.twist.twist.angular.z = round4(velocity.z());
  }
  return message;
}

geometry_msgs::PoseWithCovarianceStamped position_message(const PositionRow& row) {
  geometry_msgs::PoseWithCovarianceStamped message;
  message.header.stamp = to_ros(row.stamp);
  message.header.frame_id = "map";
  message.pose.pose = pose_message({row.position.x(), row.position.y(), 0.0});
  message.pose.covariance[0] = message.pose.covariance[7] = row.variance;
  return message;
}

geometry_msgs::PoseStamped truth_message(const field_core::StampedPose& pose) {
  geometry_msgs::PoseStamped message;
  message.header.stamp = to_ros(pose.stamp);
  message.header.frame_id = "map";
  message.pose = pose_message(pose.pose);
  return message;
}

geometry_msgs::TransformStamped transform_message(field_core::Stamp stamp,
                                                  const std::string& parent,
                                                  const std::string& child,
                                                  const field_core::SE2& pose) {
  geometry_msgs::TransformStamped transform;
  transform.header.stamp = to_ros(stamp);
  transform.header.frame_id = parent;
  transform.child_frame_id = child;
  transform.transform.translation.x = pose.x();
  transform.transform.translation.y = pose.y();
  transform.transform.rotation = quaternion(pose.yaw());
  return transform;
}

field_msgs::FieldMeasurement field_message(const std::string& frame,
                                           const std::vector<std::string>& names,
                                           const FieldRow& row) {
  field_msgs::FieldMeasurement message;
  message.header.stamp = to_ros(row.stamp);
  message.header.frame_id = frame;
  message.names = names;
  message.values = row.values;
  return message;
}

}  // namespace field_bags
