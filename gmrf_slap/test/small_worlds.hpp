// Small configurations shared by the tests.
#pragma once

#include <string>

#include "gmrf_slap/slap.hpp"

namespace gmrf_slap {
namespace test {

inline HyperparameterParams theta(double kappa, double alpha, double prior = 1.0) {
  HyperparameterParams h;
  h.kappa = kappa;
  h.alpha = alpha;
  h.prior = prior;
  return h;
}

/// nx x ny sites 1 m apart from the origin, one field "a" under the given hyperparameters, no noise
/// of odometry, a start exactly known at the first site.
inline GmrfSlapParams small_world(int nx, int ny, std::vector<HyperparameterParams> thetas) {
  GmrfSlapParams p;
  p.fields = {{"a", FieldParams{}}};
  p.grid.origin = {0.0, 0.0};
  p.grid.size = {static_cast<double>(nx), static_cast<double>(ny)};
  p.hyperparameters = std::move(thetas);
  p.measurement_stddev = 0.3;
  p.odometry_noise = {0.0, 0.0, 0.0, 0.0};
  p.initial_cov_xx = p.initial_cov_yy = p.initial_cov_aa = 0.0;
  return p;
}

inline field_core::Sample sample_of(std::vector<field_core::Reading> readings) {
  field_core::Sample sample;
  sample.readings = std::move(readings);
  return sample;
}

inline field_core::OdometryIncrement motion(double x, double y, double yaw) {
  field_core::OdometryIncrement increment;
  increment.delta = field_core::SE2(x, y, yaw);
  return increment;
}

}  // namespace test
}  // namespace gmrf_slap
