#include "gp_localize/odometry_calibration.hpp"

#include <cmath>

namespace gp_localize {

field_core::OdometryMotion OdometryCalibration::correct(const field_core::OdometryMotion& m) const {
  const double half_drift = 0.5 * drift * std::abs(m.trans) * translation;
  return {rotation * m.rot1 + half_drift, translation * m.trans, rotation * m.rot2 + half_drift};
}

bool OdometryCalibrationModel::active() const {
  return params_.translation_stddev > 0.0 || params_.rotation_stddev > 0.0 ||
         params_.drift_stddev > 0.0;
}

OdometryCalibration OdometryCalibrationModel::draw(field_core::Random& random) const {
  if (!active()) return {};
  if (params_.calibrated_probability > 0.0 && random.uniform() < params_.calibrated_probability) {
    return {};
  }
  return {std::exp(params_.translation_stddev * random.normal()),
          std::exp(params_.rotation_stddev * random.normal()),
          params_.drift_stddev * random.normal()};
}

void OdometryCalibrationModel::wander(double distance, OdometryCalibration& c,
                                      field_core::Random& random) const {
  if (!active() || distance == 0.0 || params_.memory <= 0.0) return;
  if (c.is_identity() && params_.calibrated_probability > 0.0) return;
  // Ornstein-Uhlenbeck with the prior as its stationary law: over `memory` metres the calibration
  // forgets to 1/e, and however long the run it stays as plausible as at the start.
  const double keep = std::exp(-distance / params_.memory);
  const double noise = std::sqrt(1.0 - keep * keep);
  c.translation = std::exp(keep * std::log(c.translation) +
                           noise * params_.translation_stddev * random.normal());
  c.rotation =
      std::exp(keep * std::log(c.rotation) + noise * params_.rotation_stddev * random.normal());
  c.drift = keep * c.drift + noise * params_.drift_stddev * random.normal();
}

}  // namespace gp_localize
