// The hyperparameters of a group of q correlated fields (coregionalization.hpp) as the vector
// theta that likelihoods are functions of:
//   q means, q log signal_stddev, q log noise_stddev, the partial correlations c_21, c_31, c_32,
//   .. c_q,q-1 in (-1, 1), d log length scales
// The correlation matrix is R = L L^T with, row by row (Joe 2006; Lewandowski, Kurowicka, Joe 2009)
//   L_ab = c_ab prod_{k<b} sqrt(1 - c_ak^2),   L_aa = prod_{k<a} sqrt(1 - c_ak^2)
// which is positive definite for all of them. A single field is a group of one: 3 + d numbers.
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "field_core/kernels.hpp"

namespace gp_localize {

using Theta = Eigen::VectorXd;

class GroupTheta {
 public:
  GroupTheta(const Theta& theta, int fields);

  static Eigen::Index size(int fields, Eigen::Index dimensions) {
    return 3 * fields + fields * (fields - 1) / 2 + dimensions;
  }
  // Where each is in theta; partials of 0 <= b < a.
  Eigen::Index mean_at(int a) const { return a; }
  Eigen::Index signal_at(int a) const { return fields_ + a; }
  Eigen::Index noise_at(int a) const { return 2 * fields_ + a; }
  Eigen::Index partial_at(int a, int b) const { return 3 * fields_ + a * (a - 1) / 2 + b; }
  Eigen::Index lengths_at() const { return 3 * fields_ + fields_ * (fields_ - 1) / 2; }

  int fields() const { return fields_; }
  double mean(int a) const { return theta_[mean_at(a)]; }
  double signal_stddev(int a) const { return std::exp(theta_[signal_at(a)]); }
  double noise_stddev(int a) const { return std::exp(theta_[noise_at(a)]); }
  field_core::Place length_scales() const;
  /// R and B = diag(s) R diag(s), q x q.
  const Eigen::MatrixXd& correlation() const { return correlation_; }
  const Eigen::MatrixXd& covariance() const { return covariance_; }

  /// Adds to a gradient by theta what follows from `slope`, the q x q derivatives by the elements
  /// of B (each element on its own). O(q^3).
  void add_gradient(const Eigen::MatrixXd& slope, Theta& gradient) const;

 private:
  double partial(int a, int b) const { return theta_[partial_at(a, b)]; }

  Theta theta_;
  int fields_;
  Eigen::MatrixXd factor_, correlation_, covariance_;
};

}  // namespace gp_localize
