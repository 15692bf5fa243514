// Writing a recording as a ROS bag, the same bytes every time.
#pragma once

#include <string>
#include <vector>

#include "field_bags/recording.hpp"

namespace field_bags {

/// Writes a bag (bz2 chunks) with the topics
///   /odom          nav_msgs/Odometry           odom -> base_link, velocity from the last two
///   poses,
///                                              covariances zero (not known)
///   /tf            tf2_msgs/TFMessage          the same poses
///   /field         field_msgs/FieldMeasurement all fields in one message
///   /position      geometry_msgs/PoseWithCovarianceStamped   if the robot was seen from outside
///   /ground_truth  geometry_msgs/PoseStamped   base_link in map
///   /tf_static     tf2_msgs/TFMessage          base_link -> sensor frame, latched, if they differ
/// Of a robot with a name all topics but /tf and /tf_static, and all frames but map, are below that
/// name: /anna/odom, anna/base_link.
///
/// Record times are the stamps (at least 1 ns: rosbag knows no time 0), in order; at equal stamps
/// the order is that of the list above. Quaternions are rounded to 1e-9, so that the last bits of a
/// mathematics library never show.
///
/// The bag is written under a temporary name in the same folder, synced and renamed: it is there
/// whole or not at all. Complexity O(n log n) in the number of messages.
/// @throws field_core::DataError naming the path and the reason; a stamp that ROS cannot hold
void write_bag(const std::vector<Recording>& robots, const std::string& path);

}  // namespace field_bags
