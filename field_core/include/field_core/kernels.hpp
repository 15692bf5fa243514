// Stationary covariance functions with one length scale per axis (automatic relevance
// determination).
#pragma once

#include <Eigen/Core>
#include <string>

namespace field_core {

enum class KernelType { squared_exponential, matern32, matern52 };

/// Covariance of the noise-free field between two places; measurement noise is never part of it.
/// With r^2 = sum_i ((a_i - b_i) / length_scale_i)^2 (Rasmussen and Williams 2006, chapter 4):
///   squared_exponential  s^2 exp(-r^2 / 2)            <- the 1/2 is inside
///   matern32             s^2 (1 + sqrt(3) r) exp(-sqrt(3) r)
///   matern52             s^2 (1 + sqrt(5) r + 5 r^2 / 3) exp(-sqrt(5) r)
class Kernel {
 public:
  /// @throws ParameterError unless all numbers are finite and positive
  Kernel(KernelType type, double signal_stddev, const Eigen::Vector2d& length_scales);

  double operator()(const Eigen::Vector2d& a, const Eigen::Vector2d& b) const;
  /// Matrix of covariances between the columns of a (2 x m) and b (2 x n).
  Eigen::MatrixXd matrix(const Eigen::Ref<const Eigen::Matrix2Xd>& a,
                         const Eigen::Ref<const Eigen::Matrix2Xd>& b) const;

  KernelType type() const { return type_; }
  double signal_variance() const { return signal_variance_; }
  const Eigen::Vector2d& length_scales() const { return length_scales_; }

 private:
  KernelType type_;
  double signal_variance_;
  Eigen::Vector2d length_scales_;
};

/// The correlation as a function of r^2 alone: 1 at 0.
double correlation(KernelType type, double squared_distance);
/// Its derivative with respect to r^2, never positive; for gradients by the length scales.
double correlation_slope(KernelType type, double squared_distance);

}  // namespace field_core
