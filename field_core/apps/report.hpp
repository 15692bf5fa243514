// What an evaluation looks like: a table for people, JSON for programs, data for the pictures.
#pragma once

#include <string>

#include "evaluation.hpp"

namespace field_eval {

/// One aligned table, one row per trajectory; "-" where there is no number.
std::string table(const Evaluation& evaluation);

/// The same numbers, units in the keys; null where there is no number.
std::string json(const Evaluation& evaluation);

/// JSON of the aligned paths, position errors and two-sigma bounds, for plot_trajectory_errors.py.
/// Two sigma is 2 sqrt(largest eigenvalue of the covariance of (x, y)).
std::string plot_data(const Evaluation& evaluation);

}  // namespace field_eval
