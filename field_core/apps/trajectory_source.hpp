// Where trajectories come from: .tum and .csv files, and topics of bags.
#pragma once

#include <string>

#include "field_core/trajectory.hpp"

namespace field_eval {

/// Empty if `source` is of a form that load() knows (x.tum, x.csv, x.bag:/topic), else what to
/// write.
std::string problem_of_source(const std::string& source);

/// @throws DataError naming the file, and line or topic. A bag is read by `rosrun field_ros
///         bag_trajectory`, so that this program needs no ROS itself.
field_core::Trajectory load(const std::string& source);

}  // namespace field_eval
