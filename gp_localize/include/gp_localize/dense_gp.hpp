// The paper's baselines: Gaussian processes whose cost grows with the measurements that they keep
// (section 2.1, 2.2 and 4).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "field_core/kernels.hpp"
#include "gp_localize/params.hpp"

namespace gp_localize {

/// Which of `count` measurements, oldest first, a subset-of-data model of at most `size` uses:
/// full_gp all, sod_truncate the most recent, sod_even evenly over time with the first and the
/// last.
/// @throws ParameterError for a model that is none of these three
std::vector<int> select_subset(ObservationModelType model, int count, int size);

/// A measurement along a path.
struct Measured {
  field_core::Place place;
  double value;  ///< minus the prior mean
  double noise_variance;
};

/// Exact regression, eq. (1)-(2) or (3)-(4), on a subset of the measurements along one path.
/// Memory O(t) for the measurements and O(n^2) for the n that are used.
class DenseGp {
 public:
  DenseGp(ObservationModelType model, int subset_size) : model_(model), subset_size_(subset_size) {}

  /// `value` is minus the prior mean. O(n^2) if the subset only grows (full_gp), else O(n^3).
  void append(const field_core::Kernel& kernel, const field_core::Place& place, double value,
              double noise_variance);

  /// Mean and variance of the noise-free field at points (d x q), 2 x q. O(n^2 q).
  void predict(const field_core::Kernel& kernel, const field_core::Places& points,
               Eigen::Matrix2Xd& moments) const;

  /// How many measurements the prediction uses.
  int used() const { return static_cast<int>(used_.size()); }
  /// Bound of the norm of the predictive mean in the kernel's space: |F^-1 z|. O(n).
  double mean_norm() const { return whitened_.head(used()).norm(); }
  /// Measurements, oldest first.
  const std::vector<Measured>& data() const { return data_; }

 private:
  void refactorize(const field_core::Kernel& kernel);
  void append_row(const field_core::Kernel& kernel);

  ObservationModelType model_;
  int subset_size_;
  std::vector<Measured> data_;
  std::vector<int> used_;
  field_core::Places places_;  // of the used measurements
  Eigen::MatrixXd factor_;     // lower Cholesky factor of their covariance, in a larger matrix
  Eigen::VectorXd whitened_;   // factor^-1 values
};

}  // namespace gp_localize
