// The online sparse Gaussian process of one field along one path (Xu et al. 2014, section 3.1).
//
// Notation as in support_basis.hpp: phi(x) whitened features, sigma_xx'|S the covariance that the
// support leaves open, u ~ N(0, I) the whitened support values, sigma_n^2 the noise of a
// measurement. The paper's slice n is the set of measurements D_n; PITC takes slices as independent
// given u.
//
// Within a slice, let F F^T = Sigma_{D'D'|S} + noise grow by one row per measurement. Measurement i
// then says y_i = v_i^T u + e_i with independent e_i ~ N(0, 1), where
//   f = first i-1 entries of row i of F,  F_ii^2 = sigma_ii|S + sigma_n^2 - |f|^2
//   v_i = (phi_i - sum_j f_j v_j) / F_ii,  y_i = (z_i - mu_i - sum_j f_j y_j) / F_ii
// since sum_i v_i v_i^T = Phi' (Sigma_{D'D'|S} + noise)^-1 Phi'^T is the slice summary of
// definition 1 in whitened coordinates, A = (I + sum v v^T)^-1 = L^T (Sigma_SS^N)^-1 L and m = A
// sum v y carry definition 2, and each measurement is one rank-one update of both (no spike when a
// slice ends).
//
// A prediction at x knows the open slice directly, not only through u (eq. 12-13, the PIC block of
// Snelson 2007): with w = F^-1 Sigma_{D'x|S} and p = phi - sum_j w_j v_j,
//   mean = mu + p^T m + w^T y,    variance = sigma_xx|S - |w|^2 + p^T A p      (>= 0 by parts)
// With an empty open slice that is eq. (10)-(11), offline PITC; slice size 1 is FITC.
// The same w, p and A p also extend the slice by a measurement at x: f = w, v = p / F_ii.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "gp_localize/support_basis.hpp"

namespace gp_localize {

/// Whether predictions use the open slice too (eq. 12-13), or closed slices only (eq. 10-11).
enum class Recent { used, ignored };

class OnlineSparseGp {
 public:
  /// Working memory for evaluate(), to be reused between calls and objects.
  struct Evaluation {
    double mean = 0.0;                ///< of the field minus its prior mean
    double variance = 0.0;            ///< of the noise-free field
    double unexplained = 0.0;         ///< sigma_xx|S - |w|^2
    std::vector<double> covariances;  ///< w
    std::vector<double> features;     ///< p
    std::vector<double> gain;         ///< A p; with Recent::ignored A phi
  };

  OnlineSparseGp(int support_size, int slice_size, Recent recent);

  /// Prediction at `point` with features `phi` (m numbers, `stride` apart). O(m^2 + open m).
  void evaluate(const SupportBasis& basis, const Eigen::Vector2d& point, const double* phi,
                Eigen::Index stride, Evaluation& at) const;

  /// Adds a measurement where `at` was evaluated; `value` is z minus the prior mean. The slice
  /// closes by itself with the measurement that fills it. `at` is used up. O(m^2).
  void append(const Eigen::Vector2d& point, const double* phi, Eigen::Index stride, Evaluation& at,
              double value, double noise_variance);

  /// Closes the slice before it is full: later measurements are independent of it given u (remark
  /// 2).
  void end_slice();

  int open() const { return open_; }
  int support_size() const { return m_; }
  int slice_size() const { return slice_size_; }

  /// Whitened posterior of the support: A (lower triangle by columns) and m. With Recent::used the
  /// open measurements are in it, as a block of their own.
  const double* covariance() const { return data_.data(); }
  const double* mean() const { return data_.data() + packed(); }
  /// A followed by m in one piece.
  const double* summary() const { return data_.data(); }
  /// The same with the open slice taken out again: summary_size(m) numbers. O(open m^2).
  void closed_summary(double* out) const;
  static int summary_size(int support_size) { return support_size * (support_size + 3) / 2; }
  /// The open slice, oldest first.
  Eigen::Vector2d open_point(int i) const { return {row(i)[0], row(i)[1]}; }
  double open_value(int i) const { return row(i)[3]; }
  double open_noise(int i) const { return row(i)[4]; }
  const double* open_features(int i) const { return row(i) + kRowHead + m_; }

  /// All numbers of the object, for state files: the size depends on m and slice_size only.
  std::vector<double> numbers() const;
  void restore(const double* numbers);
  static std::size_t number_count(int support_size, int slice_size);

 private:
  static constexpr int kRowHead = 5;  // x, y, whitened value, value, noise variance
  int packed() const { return m_ * (m_ + 1) / 2; }
  int row_size() const { return kRowHead + 2 * m_ + slice_size_; }
  const double* row(int i) const { return data_.data() + packed() + m_ + i * row_size(); }
  double* row(int i) { return data_.data() + packed() + m_ + i * row_size(); }

  void assimilate(double whitened_value, const double* v, const double* gain);

  int m_;
  int slice_size_;
  Recent recent_;
  int open_ = 0;
  // A | m | rows of the open slice: head, v (m), phi (m), F (slice_size, the diagonal included).
  std::vector<double> data_;
};

}  // namespace gp_localize
