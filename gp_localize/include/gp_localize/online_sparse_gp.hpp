// The online sparse Gaussian process of one field along one path (Xu et al. 2014, section 3.1).
//
// Notation as in support_basis.hpp: phi(x) whitened features, sigma_xx'|S the covariance that the
// support leaves open, u the whitened support values, sigma_n^2 the noise of a measurement. The
// paper's slice n is the set of measurements D_n; PITC takes slices as independent given u.
//
// Closed slices leave u ~ N(m, A) with A = L^T (Sigma_SS^N)^-1 L and m = A times the whitened
// mu_S^N (definition 2), so that with k~(x, x') = k(x, x') - phi^T phi' + phi^T A phi'
//   mean = mu + phi^T m,    variance = k~(x, x) = sigma_xx|S + phi^T A phi     (10)-(11)
// which is offline PITC. The open slice D' is conditioned on directly (eq. 12-13, the PIC block of
// Snelson 2007). With F F^T = Sigma~_{D'D'} + noise, grown by one row per measurement,
//   q = F^-1 Sigma~_{D'x},  y = F^-1 (z - mu - phi^T m),  mean += q^T y,  variance -= q^T q
// The same q is the next row of F if x is measured; its last entry is sqrt(variance + noise).
// When a slice closes, G = A Phi' F^-T gives A <- A - G G^T, m <- m + G y. Slice size 1 is FITC.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "gp_localize/open_slice.hpp"
#include "gp_localize/support_basis.hpp"

namespace gp_localize {

class OnlineSparseGp {
 public:
  using Evaluation = gp_localize::Evaluation;

  /// @param dimensions coordinates of a place
  OnlineSparseGp(int support_size, int slice_size, Recent recent, int dimensions = 2)
      : slice_size_(slice_size),
        dimensions_(dimensions),
        recent_(recent),
        closed_(support_size),
        slice_(support_size, slice_size, dimensions) {}

  /// Prediction at `point` with features `phi` (m numbers, `stride` apart). O(m^2 + open m).
  void evaluate(const SupportBasis& basis, const Place& point, const double* phi,
                Eigen::Index stride, Evaluation& at) const;

  /// Adds a measurement where `at` was evaluated; `value` is z minus the prior mean. O(m); the
  /// measurement that fills the slice closes it, O(slice_size m^2).
  void append(const Place& point, const double* phi, Eigen::Index stride, Evaluation& at,
              double value, double noise_variance);

  /// Closes the slice before it is full: later measurements are independent of it given u (remark
  /// 2).
  void end_slice() { slice_.close(closed_, closed_); }

  int open() const { return slice_.open(); }
  int support_size() const { return closed_.support_size(); }
  int slice_size() const { return slice_size_; }

  /// Whitened posterior of the support given the closed slices: A (lower triangle by columns), m,
  /// and both in one piece of summary_size(m) numbers.
  const double* covariance() const { return closed_.covariance(); }
  const double* mean() const { return closed_.mean(); }
  const double* summary() const { return closed_.numbers(); }
  static int summary_size(int support_size) { return SupportPosterior::size(support_size); }
  /// The open slice, oldest first.
  Place open_point(int i) const { return slice_.point(i); }
  double open_value(int i) const { return slice_.value(i); }
  double open_noise(int i) const { return slice_.noise(i); }
  const double* open_features(int i) const { return slice_.features(i); }

  /// All numbers of the object, for state files: the size depends on m, slice_size and d only.
  std::vector<double> numbers() const;
  void restore(const double* numbers);
  static std::size_t number_count(int support_size, int slice_size, int dimensions = 2);

 private:
  int slice_size_, dimensions_;
  Recent recent_;
  SupportPosterior closed_;
  OpenSlice slice_;
};

}  // namespace gp_localize
