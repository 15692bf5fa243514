// Topics and frames of each robot of a node, all defaults filled in.
//
// A node of one robot has the topics odom, field, initialpose and position, and publishes ~pose and
// so on. In a node of several, robot "anna" has anna/odom, anna/field, ... with the frames
// anna/odom and anna/base_link, and ~anna/pose; robot_interfaces changes each of them.
#pragma once

#include <string>
#include <vector>

#include "field_ros/node_params.hpp"

namespace field_ros {

struct RobotInterface {
  std::string name;    ///< "" if the estimator knows of one robot only
  std::string prefix;  ///< of what is published for it: "", or its name with a slash after it
  std::string odom, field, position, initialpose;
  std::string odom_frame_id, base_frame_id;
  std::vector<SensorParams> sensors;
};

/// @param robots names as the estimator has them; {""}: one robot without a name
/// @throws ParameterError: robot_interfaces names another robot, a name is no legal topic, robots
/// share a topic or a frame of odometry
std::vector<RobotInterface> robot_interfaces(const NodeParams& params,
                                             const std::vector<std::string>& robots);

}  // namespace field_ros
