// The two parts of an online sparse Gaussian process (online_sparse_gp.hpp): what closed slices
// say of the support, and the open slice. Apart, because many paths may share the former.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "gp_localize/support_basis.hpp"

namespace gp_localize {

/// Whether predictions use the open slice too (eq. 12-13), or closed slices only (eq. 10-11).
enum class Recent { used, ignored };

/// u ~ N(m, A) in whitened coordinates, from closed slices: A = L^T (Sigma_SS^N)^-1 L.
class SupportPosterior {
 public:
  /// The prior N(0, I).
  explicit SupportPosterior(int support_size);

  int support_size() const { return m_; }
  const double* covariance() const { return numbers_.data(); }  ///< lower triangle by columns
  const double* mean() const { return numbers_.data() + m_ * (m_ + 1) / 2; }
  /// A followed by m: size(m) numbers.
  const double* numbers() const { return numbers_.data(); }
  double* numbers() { return numbers_.data(); }
  static int size(int support_size) { return support_size * (support_size + 3) / 2; }

 private:
  int m_;
  std::vector<double> numbers_;
};

/// Prediction at one place; working memory to be reused between calls and objects.
struct Evaluation {
  double mean = 0.0;         ///< of the field minus its prior mean
  double variance = 0.0;     ///< of the noise-free field
  double recent_mean = 0.0;  ///< the same with the open slice, whatever Recent says
  double recent_variance = 0.0;
  std::vector<double> covariances;  ///< q = F^-1 Sigma~_{D'x}
  std::vector<double> gain;         ///< A phi
  std::vector<double> features;     ///< phi, where it had to be gathered
  int rows = 0;                     ///< measurements of the open slice that this accounts for
};

/// The measurements since the last slice was closed, conditioned on the closed ones.
class OpenSlice {
 public:
  /// @param dimensions coordinates of a place, of a group with the field's number
  OpenSlice(int support_size, int slice_size, int dimensions = 2);

  /// Eq. (12)-(13), or (10)-(11), at `point` with features `phi` (m numbers). O(m^2 + open m).
  void evaluate(const SupportBasis& basis, const SupportPosterior& closed, const Place& point,
                const double* phi, Recent recent, Evaluation& at) const;
  /// Brings what evaluate() found at `point` up to date with measurements appended since; the
  /// means and variances without the open slice stay. O(new (m + open)).
  void update(const SupportBasis& basis, const Place& point, const double* phi,
              Evaluation& at) const;
  /// Covariance of two fields of a group at one place, both evaluated there. O(m + open).
  double covariance(double prior, const double* phi_a, const Evaluation& a, const double* phi_b,
                    const Evaluation& b, Recent recent) const;
  /// Adds a measurement where `at` was evaluated; `value` is z minus the prior mean. O(m).
  void append(const Place& point, const double* phi, const Evaluation& at, double value,
              double noise_variance);
  /// Definition 2: `after` is `before` with the measurements of this slice, which is empty then.
  /// The two may be one object. O(open m^2).
  void close(const SupportPosterior& before, SupportPosterior& after);
  /// The support has got a point more. The coordinate of u that it adds is independent of the
  /// closed slices, so that nothing but the features of the measurements changes. O(open m).
  void extend(const SupportBasis& basis);
  /// Forgets the measurements.
  void clear() { open_ = 0; }
  /// The same measurements as `other`, of the same sizes; copies only what is in use.
  void copy_from(const OpenSlice& other);

  int open() const { return open_; }
  bool full() const { return open_ == slice_size_; }
  Place point(int i) const;
  double value(int i) const { return head(i)[1]; }
  double noise(int i) const { return head(i)[2]; }
  const double* features(int i) const { return gains() + (slice_size_ + i) * m_; }

  /// For state files: open() and numbers(), whose size depends on m, slice size and d only.
  const std::vector<double>& numbers() const { return numbers_; }
  void restore(int open, const double* numbers);
  static std::size_t number_count(int support_size, int slice_size, int dimensions = 2);

 private:
  /// q, recent_mean and recent_variance from row at.rows on, whose covariances are in at already.
  void condition(Evaluation& at) const;

  static constexpr int kHead = 3;  // whitened value, value, noise variance
  int padded() const { return (slice_size_ + 3) / 4 * 4; }
  int field_of(const SupportBasis& basis, int i) const {
    return basis.fields() > 1 ? static_cast<int>(coordinates(basis.dimensions())[i]) : 0;
  }
  const double* coordinates(int axis) const { return numbers_.data() + axis * padded(); }
  const double* head(int i) const { return coordinates(dimensions_) + kHead * i; }
  const double* factor(int i) const { return head(slice_size_) + slice_size_ * i; }
  const double* gains() const { return factor(slice_size_); }

  int m_, slice_size_, dimensions_;
  int open_ = 0;
  // x | y | ... | heads | F (rows, 1 / F_ii on the diagonal) | gains phi - A phi (rows) | phi
  // (rows)
  std::vector<double> numbers_;
};

}  // namespace gp_localize
