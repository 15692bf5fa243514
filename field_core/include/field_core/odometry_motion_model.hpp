// The odometry motion model of Thrun, Burgard, Fox, "Probabilistic Robotics" (2005), tables 5.5
// and 5.6.
#pragma once

#include <Eigen/Core>

#include "field_core/random.hpp"
#include "field_core/se2.hpp"

namespace field_core {

/// Noise of the odometry, amcl's parameters odom_alpha1..odom_alpha4. Like amcl, the terms add as
/// variances of rotation 1, translation and rotation 2:
///   var(rot_i)  = alpha1 rot_i^2 + alpha2 trans^2
///   var(trans)  = alpha3 trans^2 + alpha4 (rot_1^2 + rot_2^2)
struct OdometryNoise {
  double alpha1 = 0.2;  ///< rotation from rotation [1]
  double alpha2 = 0.2;  ///< rotation from translation [rad^2/m^2]
  double alpha3 = 0.2;  ///< translation from translation [1]
  double alpha4 = 0.2;  ///< translation from rotation [m^2/rad^2]
};

/// A motion as turn, straight line, turn. The line may be driven backwards (trans < 0), so that
/// reversing is not taken for two half turns; when the robot turns in place the whole turn is
/// rot_2.
struct OdometryMotion {
  double rot1 = 0.0;   ///< [rad]
  double trans = 0.0;  ///< [m], negative when driving backwards
  double rot2 = 0.0;   ///< [rad]

  /// Decomposition of a motion in the robot's frame. Motions shorter than 1e-6 m count as turns.
  static OdometryMotion from(const SE2& delta);
  SE2 delta() const;
};

/// Gaussian approximation of the pose after a motion: coordinates (x, y, yaw) of the map frame.
struct MotionPrediction {
  SE2 mean;
  Eigen::Matrix3d pose_jacobian;    ///< d mean / d (x, y, yaw) of the pose before
  Eigen::Matrix3d motion_jacobian;  ///< d mean / d (rot1, trans, rot2)
  Eigen::Matrix3d motion_noise;     ///< covariance of (rot1, trans, rot2), diagonal

  /// Covariance after the motion of a pose with `before`; complexity O(1).
  Eigen::Matrix3d covariance(const Eigen::Matrix3d& before) const;
};

/// Stateless; all functions O(1).
class OdometryMotionModel {
 public:
  explicit OdometryMotionModel(const OdometryNoise& noise) : noise_(noise) {}

  /// Variances of (rot1, trans, rot2) for a motion.
  Eigen::Vector3d variances(const OdometryMotion& motion) const;
  /// Table 5.6: a pose after the motion, with sampled noise.
  SE2 sample(const SE2& pose, const OdometryMotion& motion, Random& random) const;
  /// Mean, Jacobians and covariance from the same parameters.
  MotionPrediction predict(const SE2& pose, const OdometryMotion& motion) const;

  const OdometryNoise& noise() const { return noise_; }

 private:
  OdometryNoise noise_;
};

}  // namespace field_core
