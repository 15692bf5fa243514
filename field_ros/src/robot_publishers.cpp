#include <geometry_msgs/PoseArray.h>

#include "field_ros/convert.hpp"
#include "field_ros/publishers.hpp"

namespace field_ros {

RobotPublishers::RobotPublishers(ros::NodeHandle& handle, const Session& session, int robot)
    : session_(session), robot_(robot) {
  const std::string& prefix = session.interface(robot).prefix;
  pose_ = handle.advertise<geometry_msgs::PoseWithCovarianceStamped>(prefix + "pose", 10);
  path_publisher_ = handle.advertise<nav_msgs::Path>(prefix + "path", 1);
  particles_ = handle.advertise<geometry_msgs::PoseArray>(prefix + "particlecloud", 2);
  candidates_ = handle.advertise<sensor_msgs::PointCloud2>(prefix + "candidates", 2);
  vectors_ = handle.advertise<visualization_msgs::MarkerArray>(prefix + "vectors", 2);
}

void RobotPublishers::publish_belief() {
  const field_core::Belief& belief = session_.belief(robot_);
  const std::string& frame = session_.params().global_frame_id;
  pose_.publish(to_pose_message(belief, frame));
  publish_path(belief);
  if (vectors_.getNumSubscribers() > 0) vectors_.publish(to_markers(belief, frame));
  if (!belief.particles.empty()) publish_particles(belief);
}

void RobotPublishers::publish_particles(const field_core::Belief& belief) {
  const std::string& frame = session_.params().global_frame_id;
  if (candidates_.getNumSubscribers() > 0) candidates_.publish(to_weighted_cloud(belief, frame));
  if (particles_.getNumSubscribers() == 0) return;
  geometry_msgs::PoseArray cloud;
  cloud.header.stamp = to_ros(belief.stamp);
  cloud.header.frame_id = frame;
  for (const auto& particle : belief.particles) cloud.poses.push_back(to_pose(particle.pose));
  particles_.publish(cloud);
}

void RobotPublishers::publish_path(const field_core::Belief& belief) {
  geometry_msgs::PoseStamped pose;
  pose.header.stamp = to_ros(belief.stamp);
  pose.header.frame_id = session_.params().global_frame_id;
  pose.pose = to_pose(belief.mean);
  path_.push_back(pose);
  if (path_.size() > static_cast<std::size_t>(session_.params().path_length)) path_.pop_front();
  // A long path is large: it is only put together for those who look.
  if (path_publisher_.getNumSubscribers() == 0) return;
  nav_msgs::Path path;
  path.header = pose.header;
  path.poses.assign(path_.begin(), path_.end());
  path_publisher_.publish(path);
}

void RobotPublishers::publish_transform() {
  const NodeParams& params = session_.params();
  const auto odometry = session_.newest_odometry(robot_);
  const auto& map_to_odom = session_.map_to_odom(robot_);
  if (!params.tf_broadcast || !map_to_odom || !odometry) return;
  if (odometry->stamp == transform_stamp_) return;  // tf warns of a stamp that comes twice
  transform_stamp_ = odometry->stamp;
  geometry_msgs::TransformStamped transform;
  transform.header.frame_id = params.global_frame_id;
  transform.header.stamp =
      to_ros(odometry->stamp + field_core::stamp_from_seconds(params.transform_tolerance));
  transform.child_frame_id = session_.interface(robot_).odom_frame_id;
  transform.transform = to_transform(*map_to_odom);
  broadcaster_.sendTransform(transform);
}

}  // namespace field_ros
