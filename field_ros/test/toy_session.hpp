// A session of the toy estimator.
#pragma once

#include <optional>
#include <string>

#include "field_ros/session.hpp"
#include "toy_estimator.hpp"

namespace field_ros_test {

/// Starts at x = 10 m. tf knows the frame "mast", 2 m to the left of the base.
inline field_ros::Session make_session(const std::string& extra = "") {
  const auto entry = field_ros::estimator_entry<ToyEstimator>();
  return field_ros::Session(
      entry.make(field_ros::ParamTree::from_yaml_text(
                     "noise_stddev: 0.5\ninitial_pose_x: 10.0\n" + extra, "toy.yaml"),
                 std::nullopt),
      [](const std::string&, const std::string& frame, field_core::Stamp) {
        return frame == "mast" ? std::optional<field_core::SE2>(field_core::SE2(0.0, 2.0, 0.0))
                               : std::nullopt;
      });
}

}  // namespace field_ros_test
