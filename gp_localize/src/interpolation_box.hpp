// Functions of the place that are as smooth as a squared exponential kernel makes them, known at
// the nodes of a small grid and wanted at many places of a box: interpolation by Chebyshev
// polynomials, with a bound of its error that holds before anything is evaluated.
//
// Along one axis let the box have half width h and the kernel length scale l. A function in the
// kernel's space extends to complex places z with |k(., z)|^2 = sigma^2 exp(2 b^2 / l^2), b the
// imaginary part; so predictive means f and variances v, conditioned on whatever measurements, obey
//   |f(z)| <= |f|_H sigma exp(b^2 / l^2),      |v(z)| <= sigma^2 exp(2 b^2 / l^2)
// (Cauchy-Schwarz, and a posterior covariance is below the prior's). On the Bernstein ellipse of
// parameter rho, b <= h (rho - 1/rho) / 2, and the interpolant through n Chebyshev points errs by
// at most 4 M rho^-(n-1) / (rho - 1) with M the bound on the ellipse (Trefethen, "Approximation
// Theory and Approximation Practice", theorem 8.2). Any rho > 1 gives a valid n; the smallest is
// taken.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "field_core/kernels.hpp"

namespace gp_localize {

/// What the interpolated functions are allowed to be off by, over their own bounds: |f|_H sigma for
/// means, sigma^2 for variances.
struct InterpolationTolerance {
  double mean = 0.0;
  double variance = 0.0;
};

/// Nodes along an axis of half width `half_width` length scales. O(1).
int chebyshev_order(double half_width, const InterpolationTolerance& tolerance);

/// The box around places and its nodes. Allocates only when P or `most` grow.
class InterpolationBox {
 public:
  /// That fit_where_it_pays() uses.
  static constexpr int kMostNodes = 256;

  /// Lays the box around the columns of `places` (2 x P). False, and nothing else can be asked, if
  /// more than `most` nodes would be needed.
  bool fit(const field_core::Places& places, const field_core::Place& length_scales,
           const InterpolationTolerance& tolerance, Eigen::Index most);

  /// The same for predictions that are weighed under noise, where the kernel is smooth and it pays:
  /// means are then off by at most the share `tolerance` of the noise's standard deviation,
  /// variances by this share of its variance. False with no tolerance or no noise.
  /// @param prior_variance of the field
  /// @param mean_norm bound of |mean|_H / sigma over all predicted functions
  /// @param pair multiplications that one prediction takes at one place
  bool fit_where_it_pays(const field_core::Kernel& kernel, const field_core::Places& places,
                         double tolerance, double noise_variance, double prior_variance,
                         double mean_norm, double pair);

  /// 2 x r.
  Eigen::Map<const Eigen::Matrix2Xd> nodes() const {
    return {nodes_.data(), 2, static_cast<Eigen::Index>(nodes_.size() / 2)};
  }
  /// P x r, by columns: value at place p = sum_k coefficients(p, k) value at node k.
  const std::vector<double>& coefficients() const { return coefficients_; }

 private:
  struct Axis {
    double centre = 0.0, half_width = 0.0;
    std::vector<double> nodes;        // on [-1, 1]
    std::vector<double> weights;      // barycentric
    std::vector<double> polynomials;  // of one place
  };
  static void set_order(int order, Axis& axis);
  static void evaluate(double place, Axis& axis);

  Axis axes_[2];
  std::vector<double> nodes_, coefficients_;
};

}  // namespace gp_localize
