// The sparse Gaussian process of one field seen from its support points, in whitened coordinates.
//
// Notation: S support points (m of them), L L^T = Sigma_SS, phi(x) = L^-1 Sigma_Sx. Then
//   Sigma_xS Sigma_SS^-1 Sigma_Sx' = phi(x)^T phi(x')   (Gamma of Quinonero-Candela and Rasmussen
//   2005) sigma_xx'|S = k(x, x') - phi(x)^T phi(x')           (what the support cannot explain)
// and the values at the support are L u with u ~ N(0, I) before any measurement. A group of
// correlated fields (coregionalization.hpp) is one such process: its places have the number of the
// field as their last coordinate.
#pragma once

#include <Eigen/Core>

#include "field_core/kernels.hpp"
#include "gp_localize/coregionalization.hpp"

namespace gp_localize {

using field_core::Place;
using field_core::Places;

/// Features of many points: row i holds component i of phi for all points.
using Features = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

class SupportBasis {
 public:
  /// @param support d x m, d as the kernel has length scales; in the plane map frame [m]
  /// @param jitter share of the signal variance added to the diagonal of Sigma_SS
  /// @param noise_variance 0: latent support; the field's noise variance: support as the paper
  /// prints it
  /// @param room how many points grow() may add; until then they are coordinates of u that no
  ///             place depends on
  /// @param group the fields at each support point; with more than one of them, jitter and kernel
  ///              are those of unit variance, and noise_variance must be 0
  /// @throws NumericalError naming the two support points that coincide, or saying that Sigma_SS is
  ///         singular, with the remedy
  SupportBasis(const field_core::Kernel& kernel, const Places& support, double jitter,
               double noise_variance, int room = 0, const Coregionalization& group = {});

  /// m, with the room to grow; of a group q times that.
  Eigen::Index size() const { return support_.cols() * group_.fields(); }
  /// Of the places without the field's number.
  const field_core::Kernel& kernel() const { return kernel_; }
  int dimensions() const { return kernel_.dimensions(); }
  int fields() const { return group_.fields(); }
  /// Coordinates of a place: d, of a group d + 1.
  int place_dimensions() const { return dimensions() + (fields() > 1 ? 1 : 0); }
  /// Which field of the group a place of place_dimensions() coordinates is of.
  template <class P>
  int field_of(const Eigen::MatrixBase<P>& place) const {
    return fields() > 1 ? static_cast<int>(place[dimensions()]) : 0;
  }
  /// Covariance of two fields of the group at one place before any measurement.
  double prior(int a, int b) const { return kernel_.signal_variance() * group_.covariance(a, b); }
  /// The points so far, d x used.
  Eigen::Ref<const Places> support() const { return support_.leftCols(used_); }

  /// Share of the signal variance at `point` that the support cannot explain: 0 to 1. O(m^2).
  double unexplained(const Place& point) const;
  bool has_room() const { return used_ < support_.cols(); }
  /// Adds a support point. L gains a row, u a coordinate that is independent of all others: what
  /// was learned stays as it is, what is learned from now on may use the point. O(m^2), allocates
  /// nothing. There must be room, and the point must not be explained already.
  void grow(const Place& point);
  /// Writes into `phi`, at `point`, the features that the point added last brought. O(m).
  void add_newest_features(const Place& point, double* phi) const;
  /// Back to the points it was made with.
  void forget_grown();

  /// phi at each column of `points` (place_dimensions() x n): size() x n. O(m^2 n); allocates only
  /// if the shape changes.
  void features(const Eigen::Ref<const Places>& points, Features& features) const;
  /// The same into size() x n numbers, row-major.
  void features(const Eigen::Ref<const Places>& points, double* features) const;

 private:
  /// Of the kernel alone; further coordinates do not count.
  void kernel_features(const Eigen::Ref<const Places>& points, double* features) const;

  field_core::Kernel kernel_;
  Coregionalization group_;
  Eigen::Index first_, used_;
  double diagonal_;  // added to that of Sigma_SS
  Places support_;
  Features whitening_;  // L^-1, lower triangular; rows from used_ on are 0
};

}  // namespace gp_localize
