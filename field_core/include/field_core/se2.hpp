// Rigid motions of the plane. Frames: right-handed, x forward, yaw counter-clockwise, in (-pi, pi].
#pragma once

#include <Eigen/Core>

namespace field_core {

/// The same angle in (-pi, pi]. [rad]
double wrap_angle(double angle);

/// Pose (x [m], y [m], yaw [rad]) of one frame in another, or the motion between two.
///
/// Tangent vectors are (v_x, v_y, omega) in the body frame; exp and log follow Sola, Deray,
/// Atchuthan, "A micro Lie theory for state estimation in robotics" (2018), section "SE(2)".
class SE2 {
 public:
  SE2() = default;
  SE2(double x, double y, double yaw) : x_(x), y_(y), yaw_(wrap_angle(yaw)) {}
  explicit SE2(const Eigen::Vector3d& v) : SE2(v.x(), v.y(), v.z()) {}

  static SE2 exp(const Eigen::Vector3d& tangent);
  Eigen::Vector3d log() const;

  double x() const { return x_; }
  double y() const { return y_; }
  double yaw() const { return yaw_; }
  Eigen::Vector2d translation() const { return {x_, y_}; }
  Eigen::Vector3d vector() const { return {x_, y_, yaw_}; }
  Eigen::Matrix2d rotation() const;

  SE2 inverse() const;
  /// this * other: `other` is given in the frame of `this`.
  SE2 operator*(const SE2& other) const;
  Eigen::Vector2d operator*(const Eigen::Vector2d& point) const;
  /// The motion from this to `to`, in the frame of this: *this * between(to) == to.
  SE2 between(const SE2& to) const { return inverse() * to; }

  /// Maps body tangents of `this` to tangents at the identity: exp(Ad v) * this == this * exp(v).
  Eigen::Matrix3d adjoint() const;

  /// d(x, y, yaw of a * b) / d(x, y, yaw of a), and the same for b: plain coordinates, not
  /// tangents.
  static Eigen::Matrix3d compose_jacobian_first(const SE2& a, const SE2& b);
  static Eigen::Matrix3d compose_jacobian_second(const SE2& a, const SE2& b);

 private:
  double x_ = 0.0, y_ = 0.0, yaw_ = 0.0;
};

/// Constant-velocity interpolation: a for fraction 0, b for fraction 1, along one arc.
SE2 interpolate(const SE2& a, const SE2& b, double fraction);

}  // namespace field_core
