// A Gaussian over a few variables as a dense covariance: the whole field of the dense engine, the
// window of the others.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <utility>
#include <vector>

#include "gmrf_slap/gaussian_field.hpp"

namespace gmrf_slap {

/// Sites of rows are indices of this block. The lower triangle of sigma() is the covariance.
class DenseBlock {
 public:
  DenseBlock() = default;
  DenseBlock(Eigen::VectorXd mean, Eigen::MatrixXd sigma)
      : n_(static_cast<int>(mean.size())), mean_(std::move(mean)), sigma_(std::move(sigma)) {}

  int size() const { return n_; }
  const Eigen::VectorXd& mean() const { return mean_; }
  const Eigen::MatrixXd& sigma() const { return sigma_; }
  double at(int i, int j) const { return sigma_(std::max(i, j), std::min(i, j)); }

  /// As GaussianField.
  void predict(const SiteRow* rows, int count, double* mean, double* variance) const;
  void covariances(const SiteRow& a, const SiteRow* b, int count, double* out) const;
  void condition(const MixtureUpdate& update);
  std::size_t memory_bytes() const {
    return 8 * (static_cast<std::size_t>(sigma_.size()) + panels_.size() + scratch_.size());
  }

 private:
  double column_dot(int i, const SiteRow& row) const {
    double sum = 0.0;
    for (std::size_t j = 0; j < static_cast<std::size_t>(row.count); ++j) {
      sum += row.weight[j] * at(i, row.site[j]);
    }
    return sum;
  }
  const double* sigma_rows(int i0, int column, double* buffer) const;
  void gather_panel(int panel, const MixtureUpdate& update, double* out, double* m) const;
  void take_shares(const MixtureUpdate& update);

  int n_ = 0;
  Eigen::VectorXd mean_;
  Eigen::MatrixXd sigma_;
  // Kept between steps so that a step allocates nothing.
  std::vector<double> panels_, scratch_, coefficients_, shares_;
};

}  // namespace gmrf_slap
