// What wheel odometry makes of a true motion: noise and, worse, systematic error.
#pragma once

#include "field_core/odometry_motion_model.hpp"
#include "field_core/params.hpp"
#include "field_core/random.hpp"

namespace field_bags {

/// Noise here is diffusive: its variance grows with the distance or the angle, whatever the rate of
/// the odometry. (odom_alpha* of the estimators grow with the square of a step instead.)
struct OdometerParams {
  double rate = 5.0;
  double translation_scale = 1.0;
  double rotation_scale = 1.0;
  double heading_drift = 0.0;
  double translation_noise = 0.0;
  double rotation_noise = 0.0;
  double heading_noise = 0.0;

  template <class Visitor>
  void visit(Visitor& v) {
    using field_core::any_number;
    using field_core::non_negative;
    v.number("rate", rate, {0.1, 200.0}, "Hz", "odometry messages per second");
    v.number("translation_scale", translation_scale, {0.1, 10.0}, "1",
             "reported over true translation: a wrong wheel diameter");
    v.number("rotation_scale", rotation_scale, {0.1, 10.0}, "1",
             "reported over true rotation: a wrong wheel base");
    v.number("heading_drift", heading_drift, any_number(), "rad/m",
             "reported turning of a robot that drives straight: wheels of unequal size");
    v.number("translation_noise", translation_noise, non_negative(), "m/sqrt(m)",
             "standard deviation over the first metre");
    v.number("rotation_noise", rotation_noise, non_negative(), "rad/sqrt(rad)",
             "standard deviation over the first radian of turning");
    v.number("heading_noise", heading_noise, non_negative(), "rad/sqrt(m)",
             "standard deviation of heading over the first metre");
  }
};

/// The motion that the odometer reports for a true one (a step short enough to be one arc).
field_core::SE2 reported_motion(const field_core::SE2& motion, const OdometerParams& params,
                                field_core::Random& random);

}  // namespace field_bags
