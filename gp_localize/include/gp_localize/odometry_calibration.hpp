// What is systematically wrong with the odometry, estimated with the pose: wheels that are larger
// than their data sheet says, a gyro that drifts.
#pragma once

#include "field_core/odometry_motion_model.hpp"
#include "field_core/random.hpp"
#include "gp_localize/params.hpp"

namespace gp_localize {

/// One particle's belief about the odometry: what to multiply or add to get the true motion.
struct OdometryCalibration {
  double translation = 1.0;  ///< true over reported distance [1]
  double rotation = 1.0;     ///< true over reported turn [1]
  double drift = 0.0;        ///< true turn beyond the reported one, per metre driven [rad/m]

  bool is_identity() const { return translation == 1.0 && rotation == 1.0 && drift == 0.0; }
  /// The motion that odometry should have reported.
  field_core::OdometryMotion correct(const field_core::OdometryMotion& reported) const;
};

/// Draws from and moves along the prior: log scales and drift are normal, and wander slowly.
class OdometryCalibrationModel {
 public:
  explicit OdometryCalibrationModel(const CalibrationParams& params) : params_(params) {}

  bool active() const;
  OdometryCalibration draw(field_core::Random& random) const;
  /// One step of the walk, after `distance` metres. No random number is drawn if nothing wanders.
  void wander(double distance, OdometryCalibration& calibration, field_core::Random& random) const;

 private:
  CalibrationParams params_;
};

}  // namespace gp_localize
