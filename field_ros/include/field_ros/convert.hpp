// Conversions between the types of field_core and ROS messages; each has its inverse where it
// matters.
#pragma once

#include <field_msgs/EstimatorState.h>
#include <geometry_msgs/Pose.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <geometry_msgs/Transform.h>
#include <ros/time.h>

#include <string>

#include "field_core/belief.hpp"
#include "field_core/se2.hpp"
#include "field_core/stamp.hpp"
#include "field_core/state.hpp"

namespace field_ros {

/// Exact in both directions; a negative stamp becomes time 0, which ROS cannot go below.
ros::Time to_ros(field_core::Stamp stamp);
field_core::Stamp from_ros(const ros::Time& time);

geometry_msgs::Pose to_pose(const field_core::SE2& pose);
geometry_msgs::Transform to_transform(const field_core::SE2& pose);
/// Projection onto the plane: yaw of the quaternion, z dropped. The quaternion must be normalized.
field_core::SE2 from_pose(const geometry_msgs::Pose& pose);
field_core::SE2 from_transform(const geometry_msgs::Transform& transform);

/// Covariance of (x, y, yaw) inside the 6 x 6 row-major one of ROS (rows 0, 1, 5), and back.
void set_covariance(const Eigen::Matrix3d& covariance,
                    geometry_msgs::PoseWithCovariance::_covariance_type& ros);
Eigen::Matrix3d get_covariance(const geometry_msgs::PoseWithCovariance::_covariance_type& ros);

geometry_msgs::PoseWithCovarianceStamped to_pose_message(const field_core::Belief& belief,
                                                         const std::string& frame);

/// Blocks are stored column-major, bit for bit.
field_msgs::EstimatorState to_message(const field_core::State& state);
/// @throws DataError naming the block whose shape and size disagree or that comes twice
field_core::State from_message(const field_msgs::EstimatorState& message);

}  // namespace field_ros
