// The sparse Gaussian process of one field seen from its support points, in whitened coordinates.
//
// Notation: S support points (m of them), L L^T = Sigma_SS, phi(x) = L^-1 Sigma_Sx. Then
//   Sigma_xS Sigma_SS^-1 Sigma_Sx' = phi(x)^T phi(x')   (Gamma of Quinonero-Candela and Rasmussen
//   2005) sigma_xx'|S = k(x, x') - phi(x)^T phi(x')           (what the support cannot explain)
// and the values at the support are L u with u ~ N(0, I) before any measurement.
#pragma once

#include <Eigen/Core>

#include "field_core/kernels.hpp"

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
  /// @throws NumericalError naming the two support points that coincide, or saying that Sigma_SS is
  ///         singular, with the remedy
  SupportBasis(const field_core::Kernel& kernel, const Places& support, double jitter,
               double noise_variance, int room = 0);

  /// m, with the room to grow.
  Eigen::Index size() const { return support_.cols(); }
  const field_core::Kernel& kernel() const { return kernel_; }
  int dimensions() const { return kernel_.dimensions(); }
  /// The points so far, d x used.
  Eigen::Ref<const Places> support() const { return support_.leftCols(used_); }

  /// Share of the signal variance at `point` that the support cannot explain: 0 to 1. O(m^2).
  double unexplained(const Place& point) const;
  bool has_room() const { return used_ < size(); }
  /// Adds a support point. L gains a row, u a coordinate that is independent of all others: what
  /// was learned stays as it is, what is learned from now on may use the point. O(m^2), allocates
  /// nothing. There must be room, and the point must not be explained already.
  void grow(const Place& point);
  /// phi_k at `point` for the point k that was added last. O(m).
  double newest_feature(const Place& point) const;
  /// Back to the points it was made with.
  void forget_grown();

  /// phi at each column of `points` (d x n): m x n. O(m^2 n); allocates only if the shape changes.
  void features(const Eigen::Ref<const Places>& points, Features& features) const;
  /// The same into m x n numbers, row-major.
  void features(const Eigen::Ref<const Places>& points, double* features) const;

 private:
  field_core::Kernel kernel_;
  Eigen::Index first_, used_;
  double diagonal_;  // added to that of Sigma_SS
  Places support_;
  Features whitening_;  // L^-1, lower triangular; rows from used_ on are 0
};

}  // namespace gp_localize
