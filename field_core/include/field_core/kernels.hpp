// Stationary covariance functions with one length scale per axis (automatic relevance
// determination).
#pragma once

#include <Eigen/Core>
#include <string>

namespace field_core {

/// A place has up to this many coordinates: two in the plane, more for the nodes of a graph that
/// are known by features and an embedding.
constexpr int kMostDimensions = 12;
/// d coordinates; never on the heap.
using Place = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMostDimensions, 1>;
/// Places as columns, d x n.
using Places = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor,
                             kMostDimensions, Eigen::Dynamic>;

enum class KernelType { squared_exponential, matern32, matern52 };

/// Covariance of the noise-free field between two places; measurement noise is never part of it.
/// With r^2 = sum_i ((a_i - b_i) / length_scale_i)^2 (Rasmussen and Williams 2006, chapter 4):
///   squared_exponential  s^2 exp(-r^2 / 2)            <- the 1/2 is inside
///   matern32             s^2 (1 + sqrt(3) r) exp(-sqrt(3) r)
///   matern52             s^2 (1 + sqrt(5) r + 5 r^2 / 3) exp(-sqrt(5) r)
class Kernel {
 public:
  /// In the plane. @throws ParameterError unless all numbers are finite and positive
  Kernel(KernelType type, double signal_stddev, const Eigen::Vector2d& length_scales);
  /// For places of as many coordinates as there are length scales.
  /// @throws ParameterError likewise, and for none or more than kMostDimensions length scales
  template <class L>
  Kernel(KernelType type, double signal_stddev, const Eigen::MatrixBase<L>& length_scales)
      : type_(type),
        signal_variance_(signal_stddev * signal_stddev),
        length_scales_(checked(signal_stddev, Eigen::VectorXd(length_scales))) {}

  double operator()(const Eigen::Vector2d& a, const Eigen::Vector2d& b) const;
  template <class A, class B>
  double operator()(const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b) const {
    return covariance((a - b).cwiseQuotient(length_scales_).squaredNorm());
  }
  /// Matrix of covariances between the columns of a (d x m) and b (d x n).
  Eigen::MatrixXd matrix(const Eigen::Ref<const Places>& a,
                         const Eigen::Ref<const Places>& b) const;

  KernelType type() const { return type_; }
  double signal_variance() const { return signal_variance_; }
  const Place& length_scales() const { return length_scales_; }
  int dimensions() const { return static_cast<int>(length_scales_.size()); }

 private:
  static Place checked(double signal_stddev, const Eigen::VectorXd& length_scales);
  double covariance(double squared_distance) const;

  KernelType type_;
  double signal_variance_;
  Place length_scales_;
};

/// The correlation as a function of r^2 alone: 1 at 0.
double correlation(KernelType type, double squared_distance);
/// Its derivative with respect to r^2, never positive; for gradients by the length scales.
double correlation_slope(KernelType type, double squared_distance);

}  // namespace field_core
