// Conversion of a recording's parts to ROS messages. Internal to the bag writer.
#pragma once

#include <field_msgs/FieldMeasurement.h>
#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <geometry_msgs/TransformStamped.h>
#include <nav_msgs/Odometry.h>
#include <ros/time.h>

#include <optional>
#include <string>
#include <vector>

#include "field_bags/recording.hpp"

namespace field_bags {

/// @throws field_core::DataError for a time before 0 or after 2106, which ROS cannot hold
ros::Time to_ros(field_core::Stamp stamp);

/// @param prefix of the robot's frames; "": none
/// @param previous the odometry pose before, for the velocity; null for the first
nav_msgs::Odometry odometry_message(const std::string& prefix, const field_core::StampedPose& pose,
                                    const field_core::StampedPose* previous);
geometry_msgs::PoseWithCovarianceStamped position_message(const PositionRow& row);
geometry_msgs::PoseStamped truth_message(const field_core::StampedPose& pose);
geometry_msgs::TransformStamped transform_message(field_core::Stamp stamp,
                                                  const std::string& parent,
                                                  const std::string& child,
                                                  const field_core::SE2& pose);
field_msgs::FieldMeasurement field_message(const std::string& frame,
                                           const std::vector<std::string>& names,
                                           const FieldRow& row);

}  // namespace field_bags
