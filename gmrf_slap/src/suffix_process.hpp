// One field along the last stretch of one trajectory, for every hyperparameter vector: exact
// Gaussian regression on top of the shared fields.
//
// The shared fields know the measurements before the stretch; those of the stretch, with rows A and
// residuals r, are a Gaussian process with covariance S = A Sigma A^T + noise. With S = F F^T and
// y = F^-1 (r - A mean), a measurement at row a has mean a mean + v^T y and variance
// a Sigma a^T - v^T v, v = F^-1 A Sigma a^T; [v, sqrt(variance + noise)] is the next row of F.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "gmrf_slap/field_bank.hpp"

namespace gmrf_slap {

class SuffixProcess {
 public:
  struct Prediction {
    double mean, variance;  ///< of the field at the row; deviations from the prior mean
  };

  SuffixProcess(int capacity, int hypotheses);

  int size() const { return size_; }
  const SiteRow& row(int i) const { return rows_[static_cast<std::size_t>(i)]; }
  double residual(int i) const { return residuals_[i]; }
  double noise(int i) const { return noises_[i]; }
  /// log p(measurements of the stretch | shared fields, theta_l, trajectory).
  double evidence(int l) const { return evidence_[l]; }

  /// O(size^2 / 2). @param row count 0: outside of the grid
  Prediction predict(int l, const FieldMixture& field, const SiteRow& row);
  /// After predict() of the same row for every l. `residual`: value - prior mean there.
  void append(const SiteRow& row, double residual, double noise);
  /// Forgets the `count` oldest and follows the fields as they are now. O(size^3 / 6) per l.
  void rebuild(int count, const FieldMixture& field);
  void clear() {
    size_ = 0;
    evidence_.setZero();
  }
  /// Copies what is in use; both have the same capacity.
  void copy_from(const SuffixProcess& other);
  /// mean[site] += what the stretch adds to the mean of the field: Sigma A^T S^-1 (r - A mean),
  /// written as weights of sites: weights += scale A^T S^-1 (r - A mean).
  void add_site_weights(int l, double scale, Eigen::VectorXd& weights) const;

 private:
  struct Factor {
    std::vector<double> rows;  ///< row i at i (i + 1) / 2
    Eigen::VectorXd white;     ///< y
    Prediction next{0.0, 0.0};
  };
  double* factor_row(Factor& f, int i) const {
    return f.rows.data() + static_cast<long>(i) * (i + 1) / 2;
  }
  void append_to(int l, double residual, double noise);

  int size_ = 0;
  std::vector<SiteRow> rows_;
  Eigen::VectorXd residuals_, noises_, evidence_;
  std::vector<Factor> factors_;
};

}  // namespace gmrf_slap
