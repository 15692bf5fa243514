// Measurements at known places: what hyperparameters are learned from, and what a map may start
// with.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "field_core/kernels.hpp"

namespace gp_localize {

/// Measurements of one field: column i of `places` (d x n; 2 x n in the map frame [m]
/// where it comes from a file) and values[i].
struct FieldSurvey {
  field_core::Places places;
  Eigen::VectorXd values;
  /// The order among the measurements of all fields; empty: not known.
  std::vector<int> order = {};
};

/// By name of the field.
using Survey = std::map<std::string, FieldSurvey>;

/// The measurements of several fields, as those of one group of correlated fields: the number of
/// the field in `names` is the last coordinate of a place; one after the other, or in their common
/// order where it is known.
FieldSurvey merge(const Survey& survey, const std::vector<std::string>& names);

/// Collects measurements one by one.
class SurveyBuilder {
 public:
  void add(const std::string& field, const Eigen::Vector2d& place, double value);
  Survey build() const;

 private:
  std::map<std::string, std::vector<Eigen::Vector3d>> rows_;  // x, y, value
  std::map<std::string, std::vector<int>> order_;
  int count_ = 0;
};

/// A CSV file with columns x_m, y_m and one per field; empty cells: not measured there.
/// @param fields the columns to read; empty: all but x_m, y_m, stamp_s and yaw_rad
/// @throws DataError naming file, line and column; or a field without any measurement
Survey read_survey(const std::string& path, const std::vector<std::string>& fields);

}  // namespace gp_localize
