#include "field_core/se2.hpp"

#include <cmath>

namespace field_core {
namespace {

// sin(w)/w and (1 - cos(w))/w. 1 - cos(w) cancels for small w, 2 sin^2(w/2) does not; the series is
// for the quotient 0/0, where its next terms are below double precision.
void arc_factors(double w, double& s, double& c) {
  if (std::abs(w) < 1e-4) {
    s = 1.0 - w * w / 6.0;
    c = w / 2.0 - w * w * w / 24.0;
  } else {
    const double half = std::sin(0.5 * w);
    s = std::sin(w) / w;
    c = 2.0 * half * half / w;
  }
}

}  // namespace

double wrap_angle(double angle) {
  if (angle > -M_PI && angle <= M_PI) return angle;
  const double wrapped = std::remainder(angle, 2.0 * M_PI);  // in [-pi, pi]
  return wrapped <= -M_PI ? M_PI : wrapped;
}

SE2 SE2::exp(const Eigen::Vector3d& v) {
  double s, c;
  arc_factors(v.z(), s, c);
  return SE2(s * v.x() - c * v.y(), c * v.x() + s * v.y(), v.z());
}

Eigen::Vector3d SE2::log() const {
  double s, c;
  arc_factors(yaw_, s, c);
  const double n = s * s + c * c;
  return {(s * x_ + c * y_) / n, (s * y_ - c * x_) / n, yaw_};
}

Eigen::Matrix2d SE2::rotation() const {
  const double c = std::cos(yaw_), s = std::sin(yaw_);
  return (Eigen::Matrix2d() << c, -s, s, c).finished();
}

SE2 SE2::inverse() const {
  const double c = std::cos(yaw_), s = std::sin(yaw_);
  return SE2(-c * x_ - s * y_, s * x_ - c * y_, -yaw_);
}

SE2 SE2::operator*(const SE2& o) const {
  const double c = std::cos(yaw_), s = std::sin(yaw_);
  return SE2(x_ + c * o.x_ - s * o.y_, y_ + s * o.x_ + c * o.y_, yaw_ + o.yaw_);
}

Eigen::Vector2d SE2::operator*(const Eigen::Vector2d& p) const {
  const double c = std::cos(yaw_), s = std::sin(yaw_);
  return {x_ + c * p.x() - s * p.y(), y_ + s * p.x() + c * p.y()};
}

Eigen::Matrix3d SE2::adjoint() const {
  const double c = std::cos(yaw_), s = std::sin(yaw_);
  return (Eigen::Matrix3d() << c, -s, y_, s, c, -x_, 0, 0, 1).finished();
}

Eigen::Matrix3d SE2::compose_jacobian_first(const SE2& a, const SE2& b) {
  const double c = std::cos(a.yaw_), s = std::sin(a.yaw_);
  Eigen::Matrix3d j = Eigen::Matrix3d::Identity();
  j(0, 2) = -s * b.x_ - c * b.y_;
  j(1, 2) = c * b.x_ - s * b.y_;
  return j;
}

Eigen::Matrix3d SE2::compose_jacobian_second(const SE2& a, const SE2&) {
  Eigen::Matrix3d j = Eigen::Matrix3d::Identity();
  j.topLeftCorner<2, 2>() = a.rotation();
  return j;
}

SE2 interpolate(const SE2& a, const SE2& b, double fraction) {
  if (fraction == 0.0) return a;
  if (fraction == 1.0) return b;
  return a * SE2::exp(fraction * a.between(b).log());
}

}  // namespace field_core
