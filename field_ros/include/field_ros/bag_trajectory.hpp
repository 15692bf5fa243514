// Topics of poses in bags as trajectories.
#pragma once

#include <string>
#include <vector>

#include "field_core/trajectory.hpp"
#include "field_ros/bag_input.hpp"

namespace field_ros {

/// The types that read_bag_trajectory() reads.
const std::vector<std::string>& pose_types();

/// Poses of a topic in order of receipt: nav_msgs/Odometry or geometry_msgs/PoseStamped,
/// PoseWithCovarianceStamped (with covariances), TransformStamped.
/// @throws DataError if the topic is missing, of another type or version, or the bag is damaged
field_core::Trajectory read_bag_trajectory(const BagInput& input, const std::string& topic);

}  // namespace field_ros
