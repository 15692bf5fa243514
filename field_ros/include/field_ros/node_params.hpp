// Parameters that every node of the suite has, with amcl's names where amcl has them.
#pragma once

#include <map>
#include <string>

#include "field_core/errors.hpp"
#include "field_core/params.hpp"
#include "field_ros/robot_params.hpp"
#include "field_ros/runtime_params.hpp"
#include "field_ros/sensor_params.hpp"

namespace field_ros {

struct NodeParams : RuntimeParams {
  std::string global_frame_id = "map";
  std::string odom_frame_id = "odom";
  std::string base_frame_id = "base_link";
  std::string state_directory = "~/.ros/field_states";
  std::string load_state;
  std::string save_name = "last";
  bool resume = false;
  bool start_anywhere = false;
  bool use_map_topic = false;
  int seed = 1;
  double map_resolution = 0.25;
  int odom_queue_size = 1000;
  int field_queue_size = 100;
  int odom_buffer_length = 2000;
  int pending_measurements = 1000;
  int max_fields_per_message = 1000;
  double reorder_window = 0.0;
  double time_jump_threshold = 1.0;
  double odom_gap_threshold = 10.0;
  bool use_sensor_frames = true;
  double sensor_transform_timeout = 10.0;
  int lost_window = 20;
  double robot_patience = 0.5;
  std::map<std::string, RobotParams> robot_interfaces;
  std::map<std::string, SensorParams> sensors;

  template <class Visitor>
  void visit(Visitor& v) {
    using field_core::non_negative;
    using field_core::positive;
    v.text("global_frame_id", global_frame_id, "frame of the map and of the published pose");
    v.text("odom_frame_id", odom_frame_id, "frame of the odometry: header.frame_id of odom");
    v.text("base_frame_id", base_frame_id, "frame of the robot: child_frame_id of odom");
    RuntimeParams::visit(v);
    v.text("state_directory", state_directory,
           "where ~save_state and ~load_state keep their files; \"\": both refuse");
    v.text("load_state", load_state,
           "name of the state to start with, as given to ~save_state; \"\": none");
    v.text("save_name", save_name, "name of the automatically saved state");
    v.flag("resume", resume,
           "start with the automatically saved state if there is one (after a crash or a reboot)");
    v.flag("start_anywhere", start_anywhere,
           "start as global_localization does: the map is known, the pose is not");
    v.flag("use_map_topic", use_map_topic,
           "wait for an occupancy grid on the topic map before the start, and let no field pass "
           "its walls (estimators that know obstacles); later maps are not looked at");
    v.number("seed", seed, non_negative(), "1", "seed of the estimator's random numbers");
    v.number("map_resolution", map_resolution, positive(), "m",
             "cell size of published field maps");
    v.number("odom_queue_size", odom_queue_size, {1, 100000}, "1", "subscriber queue of odom");
    v.number("field_queue_size", field_queue_size, {1, 100000}, "1",
             "subscriber queue of field and of each sensor");
    v.number("odom_buffer_length", odom_buffer_length, {2, 10000000}, "1",
             "latest odometry messages kept for interpolation");
    v.number("pending_measurements", pending_measurements, {1, 1000000}, "1",
             "measurements that may wait for odometry; then the oldest is dropped");
    v.number("max_fields_per_message", max_fields_per_message, {1, 100000}, "1",
             "a measurement with more fields is dropped unread");
    v.number("reorder_window", reorder_window, {0.0, 60.0}, "s",
             "a measurement waits this long for earlier ones that arrive later (several sensors)");
    v.number("time_jump_threshold", time_jump_threshold, positive(), "s",
             "two odometry messages this far back in time are a restarted clock: the node resets");
    v.number("odom_gap_threshold", odom_gap_threshold, positive(), "s",
             "an odometry message this far ahead is believed once the next one confirms it");
    v.flag("use_sensor_frames", use_sensor_frames,
           "place sensors by tf from header.frame_id to base_frame_id; false: all at the base");
    v.number("sensor_transform_timeout", sensor_transform_timeout, non_negative(), "s",
             "measurements wait this long for the transform of a sensor that tf does not know yet");
    v.number("lost_window", lost_window, {1, 10000}, "1",
             "latest measurements that the verdict 'lost' is made from");
    v.number(
        "robot_patience", robot_patience, non_negative(), "s",
        "several robots: their measurements are used in order of their stamps, and one whose "
        "odometry is this far behind the others' (it is silent, or has left) is not waited for");
    v.dictionary("robot_interfaces", robot_interfaces,
                 "topics and frames of robots, by the name of the robot; a robot that is not here "
                 "has its name as namespace, or none if it is the only one");
    v.dictionary(
        "sensors", sensors,
        "standard sensors as fields, by any name; of every robot that has none of its own");
  }
  void validate() const {
    const auto frame = [](const char* key, const std::string& value) {
      if (value.empty() || value[0] == '/') {
        throw field_core::ParameterError(
            key, "'" + value + "' is not a frame of tf2; write a name without a leading slash");
      }
    };
    frame("global_frame_id", global_frame_id);
    frame("odom_frame_id", odom_frame_id);
    frame("base_frame_id", base_frame_id);
    if (!load_state.empty() && load_state == save_name) {
      throw field_core::ParameterError("save_name",
                                       "is the same as load_state, which the automatic saving "
                                       "would replace; choose another, or use resume: true");
    }
    if (global_frame_id == odom_frame_id) {
      throw field_core::ParameterError(
          "odom_frame_id", "is the same as global_frame_id; map -> odom needs two frames");
    }
  }
};

}  // namespace field_ros
