// A robot's run as plain data: what the programs of this package read or simulate, and write to a
// bag.
#pragma once

#include <string>
#include <vector>

#include "field_core/se2.hpp"
#include "field_core/stamp.hpp"
#include "field_core/trajectory.hpp"

namespace field_bags {

/// Readings of all fields at one time, in the order of Recording::fields; NaN: not observed.
struct FieldRow {
  field_core::Stamp stamp{0};
  std::vector<double> values;
};

/// Where the robot was seen from outside, in the map frame.
struct PositionRow {
  field_core::Stamp stamp{0};
  Eigen::Vector2d position;
  double variance = 0.0;  ///< of each coordinate [m^2]
};

/// One robot's.
struct Recording {
  std::string robot;  ///< namespace of its topics and prefix of its frames; empty: none
  field_core::Trajectory odometry;  ///< base_link in odom, accumulated
  std::vector<std::string> fields;
  std::vector<FieldRow> measurements;  ///< at least one finite value per row
  std::size_t repeated = 0;            ///< readings left out: the same field at the same stamp
  std::vector<PositionRow> positions;
  field_core::Trajectory truth;  ///< base_link in map; may be empty
  std::string sensor_frame = "base_link";
  field_core::SE2 sensor_in_base;  ///< published on /tf_static unless sensor_frame is base_link
};

}  // namespace field_bags
