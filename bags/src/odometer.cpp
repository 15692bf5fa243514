#include "field_bags/odometer.hpp"

#include <cmath>

namespace field_bags {

field_core::SE2 reported_motion(const field_core::SE2& motion, const OdometerParams& params,
                                field_core::Random& random) {
  const Eigen::Vector3d twist = motion.log();
  const double distance = twist.head<2>().norm();
  const double angle = std::abs(twist.z());
  // Always three draws: a standing robot must not shift the noise of the rest of the run.
  const double translation = params.translation_noise * std::sqrt(distance) * random.normal();
  const double rotation = params.rotation_noise * std::sqrt(angle) * random.normal();
  const double heading = params.heading_noise * std::sqrt(distance) * random.normal();
  Eigen::Vector3d reported = twist;
  reported.head<2>() *= params.translation_scale;
  reported.x() += translation;
  reported.z() =
      params.rotation_scale * twist.z() + params.heading_drift * distance + rotation + heading;
  return field_core::SE2::exp(reported);
}

}  // namespace field_bags
