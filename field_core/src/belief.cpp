#include "field_core/belief.hpp"

#include <cmath>

#include "field_core/errors.hpp"

namespace field_core {

void summarize_particles(const std::vector<WeightedPose>& particles, SE2& mean,
                         Eigen::Matrix3d& covariance) {
  double total = 0.0, x = 0.0, y = 0.0, c = 0.0, s = 0.0;
  for (const auto& p : particles) {
    total += p.weight;
    x += p.weight * p.pose.x();
    y += p.weight * p.pose.y();
    c += p.weight * std::cos(p.pose.yaw());
    s += p.weight * std::sin(p.pose.yaw());
  }
  if (!(total > 0.0) || !std::isfinite(total)) {
    throw NumericalError(
        "the particle weights sum to nothing: no particle explains the measurement; widen "
        "the noise_stddev of the fields or the start (initial_cov_*)");
  }
  mean = SE2(x / total, y / total, std::atan2(s, c));
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const auto& p : particles) {
    const Eigen::Vector3d d(p.pose.x() - mean.x(), p.pose.y() - mean.y(),
                            wrap_angle(p.pose.yaw() - mean.yaw()));
    sum.noalias() += (p.weight / total) * d * d.transpose();
  }
  covariance = 0.5 * (sum + sum.transpose());
  covariance.diagonal().array() += kMinimumPoseVariance;
}

}  // namespace field_core
