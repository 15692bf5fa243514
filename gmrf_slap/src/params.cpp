#include "gmrf_slap/params.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "field_core/errors.hpp"

namespace gmrf_slap {

using field_core::ParameterError;

void GridParams::validate() const {
  for (const double n : size) {
    if (n != std::floor(n)) throw ParameterError("size", "must be two whole numbers of sites");
  }
}

void HyperparameterParams::validate() const {
  const bool paper = kappa > 0.0 && alpha > 0.0, metric = bandwidth > 0.0 && stddev > 0.0;
  const bool some_paper = kappa > 0.0 || alpha > 0.0, some_metric = bandwidth > 0.0 || stddev > 0.0;
  if ((paper && !some_metric) || (metric && !some_paper)) return;
  throw ParameterError(some_metric ? "bandwidth" : "kappa",
                       "give either kappa and alpha, or bandwidth and stddev, all > 0");
}

void FieldParams::validate() const {}

void RobotModelParams::validate() const {
  const auto all_or_none = [](const char* key, const std::vector<double>& list, std::size_t all) {
    if (list.empty() || list.size() == all) return;
    throw ParameterError(key, "must have " + std::to_string(all) + " numbers, or none");
  };
  all_or_none("initial_pose", initial_pose, 3);
  all_or_none("initial_variance", initial_variance, 3);
  all_or_none("odom_alpha", odom_alpha, 4);
}

void GmrfSlapParams::validate() const {
  for (const auto& [name, field] : fields) {
    if (field.hyperparameters.empty() && hyperparameters.empty()) {
      throw ParameterError("fields/" + name + "/hyperparameters",
                           "is empty, and so are the common hyperparameters; give "
                           "[{bandwidth: ..., stddev: ...}]");
    }
  }
  if (robots.empty()) throw ParameterError("robots", "is empty; name at least one robot");
  if (std::set<std::string>(robots.begin(), robots.end()).size() != robots.size()) {
    throw ParameterError("robots", "names a robot twice; every robot needs a name of its own");
  }
  for (const auto& [name, model] : robot_models) {
    if (std::find(robots.begin(), robots.end(), name) == robots.end()) {
      throw ParameterError("robot_models/" + name,
                           "is none of the robots; name it in 'robots' too");
    }
    for (const auto& entry : model.fields) {
      if (fields.count(entry.first) > 0) continue;
      throw ParameterError("robot_models/" + name + "/fields/" + entry.first,
                           "is none of the fields; use the name that 'fields' has");
    }
  }
}

GmrfSlapParams GmrfSlapParams::of_robot(const std::string& robot) const {
  GmrfSlapParams out = *this;
  const auto found = robot_models.find(robot);
  if (found == robot_models.end()) return out;
  const RobotModelParams& own = found->second;
  if (!own.initial_pose.empty()) {
    out.initial_pose_x = own.initial_pose[0];
    out.initial_pose_y = own.initial_pose[1];
    out.initial_pose_a = own.initial_pose[2];
  }
  if (!own.initial_variance.empty()) {
    out.initial_cov_xx = own.initial_variance[0];
    out.initial_cov_yy = own.initial_variance[1];
    out.initial_cov_aa = own.initial_variance[2];
  }
  if (!own.odom_alpha.empty()) {
    out.odometry_noise = {own.odom_alpha[0], own.odom_alpha[1], own.odom_alpha[2],
                          own.odom_alpha[3]};
  }
  if (own.position_stddev > 0.0) out.position_stddev = own.position_stddev;
  for (const auto& [field, sensor] : own.fields) {
    if (sensor.measurement_stddev > 0.0) {
      out.fields.at(field).measurement_stddev = sensor.measurement_stddev;
    }
  }
  return out;
}

}  // namespace gmrf_slap
