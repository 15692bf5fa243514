// One estimate and its baselines against the truth.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "field_core/metrics.hpp"

namespace field_eval {

/// How a baseline's file is used.
enum class BaselineKind {
  as_is,     ///< NAME=FILE: its poses are compared as they are
  odometry,  ///< NAME=odom:FILE: dead reckoning from the true start
  scaled     ///< NAME=scaled:FILE: the same with the best constant translation scale
};

struct Baseline {
  std::string name, source;
  BaselineKind kind = BaselineKind::as_is;
};

/// @throws std::invalid_argument with what is wrong and how to write it
Baseline parse_baseline(const std::string& text);

struct Options {
  std::string truth, estimate;
  std::vector<Baseline> baselines;
  field_core::Alignment alignment = field_core::Alignment::none;
  double relative_distance = 0.0;  ///< [m]; 0: a tenth of the path
};

/// One line of the table.
struct Row {
  std::string name, source;
  std::optional<double> translation_scale;  ///< of a scaled baseline
  field_core::Trajectory trajectory;        ///< before alignment
  field_core::TrajectoryErrors errors;
};

struct Evaluation {
  std::string truth_source, alignment;
  field_core::Trajectory truth;  ///< over the span of the estimate
  double duration_s = 0.0, driven_m = 0.0;
  std::vector<Row> rows;  ///< the estimate, then the baselines
};

/// Every trajectory is compared over the span of the estimate, each at its own stamps, so that the
/// rows say something about each other.
/// @throws DataError, NumericalError naming the trajectory
Evaluation evaluate(const Options& options);

}  // namespace field_eval
