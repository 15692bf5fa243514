#include "field_core/odometry_motion_model.hpp"

#include <cmath>

namespace field_core {
namespace {
constexpr double kTurnInPlace = 1e-6;  // m: below this the direction of travel means nothing
}

OdometryMotion OdometryMotion::from(const SE2& delta) {
  const double distance = std::hypot(delta.x(), delta.y());
  if (distance < kTurnInPlace) return {0.0, 0.0, delta.yaw()};
  double rot1 = std::atan2(delta.y(), delta.x());
  double trans = distance;
  if (std::abs(rot1) > M_PI / 2) {  // behind the robot: it reversed
    rot1 = wrap_angle(rot1 + M_PI);
    trans = -distance;
  }
  return {rot1, trans, wrap_angle(delta.yaw() - rot1)};
}

SE2 OdometryMotion::delta() const {
  return SE2(trans * std::cos(rot1), trans * std::sin(rot1), rot1 + rot2);
}

Eigen::Vector3d OdometryMotionModel::variances(const OdometryMotion& m) const {
  const double r1 = m.rot1 * m.rot1, t = m.trans * m.trans, r2 = m.rot2 * m.rot2;
  return {noise_.alpha1 * r1 + noise_.alpha2 * t, noise_.alpha3 * t + noise_.alpha4 * (r1 + r2),
          noise_.alpha1 * r2 + noise_.alpha2 * t};
}

SE2 OdometryMotionModel::sample(const SE2& pose, const OdometryMotion& motion,
                                Random& random) const {
  const Eigen::Vector3d v = variances(motion);
  const OdometryMotion noisy{motion.rot1 + std::sqrt(v[0]) * random.normal(),
                             motion.trans + std::sqrt(v[1]) * random.normal(),
                             motion.rot2 + std::sqrt(v[2]) * random.normal()};
  return pose * noisy.delta();
}

MotionPrediction OdometryMotionModel::predict(const SE2& pose, const OdometryMotion& motion) const {
  const double heading = pose.yaw() + motion.rot1;
  const double c = std::cos(heading), s = std::sin(heading);
  MotionPrediction p;
  p.mean = pose * motion.delta();
  p.pose_jacobian << 1, 0, -motion.trans * s, 0, 1, motion.trans * c, 0, 0, 1;
  p.motion_jacobian << -motion.trans * s, c, 0, motion.trans * c, s, 0, 1, 0, 1;
  p.motion_noise = variances(motion).asDiagonal();
  return p;
}

Eigen::Matrix3d MotionPrediction::covariance(const Eigen::Matrix3d& before) const {
  return pose_jacobian * before * pose_jacobian.transpose() +
         motion_jacobian * motion_noise * motion_jacobian.transpose();
}

}  // namespace field_core
