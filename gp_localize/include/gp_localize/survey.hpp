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
};

/// By name of the field.
using Survey = std::map<std::string, FieldSurvey>;

/// Collects measurements one by one.
class SurveyBuilder {
 public:
  void add(const std::string& field, const Eigen::Vector2d& place, double value);
  Survey build() const;

 private:
  std::map<std::string, std::vector<Eigen::Vector3d>> rows_;  // x, y, value
};

/// A CSV file with columns x_m, y_m and one per field; empty cells: not measured there.
/// @param fields the columns to read; empty: all but x_m, y_m, stamp_s and yaw_rad
/// @throws DataError naming file, line and column; or a field without any measurement
Survey read_survey(const std::string& path, const std::vector<std::string>& fields);

}  // namespace gp_localize
