// Where one robot's messages come from, in a node that serves several.
#pragma once

#include <map>
#include <string>

#include "field_core/params.hpp"
#include "field_ros/sensor_params.hpp"

namespace field_ros {

struct RobotParams {
  std::string name_space;
  std::string odom = "odom", field = "field", position = "position", initialpose = "initialpose";
  std::string odom_frame_id, base_frame_id;
  std::map<std::string, SensorParams> sensors;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("namespace", name_space,
           "of its topics, and prefix of its frames; \"\": the robot's name, or none if it is the "
           "only one");
    v.text("odom", odom, "nav_msgs/Odometry; a topic that begins with / is outside the namespace");
    v.text("field", field, "field_msgs/FieldMeasurement");
    v.text("position", position,
           "geometry_msgs/PoseWithCovarianceStamped: where the robot was seen from outside, in the "
           "map frame (if the estimator uses that)");
    v.text("initialpose", initialpose, "geometry_msgs/PoseWithCovarianceStamped");
    v.text("odom_frame_id", odom_frame_id, "\"\": the common one with the namespace before it");
    v.text("base_frame_id", base_frame_id, "\"\": the common one with the namespace before it");
    v.dictionary("sensors", sensors, "of this robot instead of the common ones");
  }
};

}  // namespace field_ros
