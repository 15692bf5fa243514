#include "gmrf_slap/field_prior.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "field_core/cholmod.hpp"
#include "field_core/csv.hpp"
#include "field_core/errors.hpp"

namespace gmrf_slap {
namespace {

using field_core::ParameterError;
using Sparse = Eigen::SparseMatrix<double>;
using Triplets = std::vector<Eigen::Triplet<double>>;

constexpr double kPi = 3.14159265358979323846;
// Beyond this condition number a Cholesky factor in double precision has too few correct digits.
constexpr double kLargestCondition = 1e12;

void check(const Theta& theta) {
  using field_core::format_number;
  if (theta.order != 1 && theta.order != 2) throw ParameterError("order", "must be 1 or 2");
  if (!(theta.kappa > 0.0) || !std::isfinite(theta.kappa)) {
    throw ParameterError("kappa", format_number(theta.kappa) +
                                      " makes the precision matrix singular; it must be > 0");
  }
  const double condition = std::pow((theta.alpha + 8.0) / theta.alpha, theta.order);
  if (!(theta.alpha > 0.0) || !(condition <= kLargestCondition)) {
    throw ParameterError("alpha", format_number(theta.alpha) +
                                      " makes the precision matrix singular to working precision; "
                                      "choose a larger alpha (a shorter bandwidth in sites)");
  }
}

void add_edge(Triplets& entries, int a, int b) {
  entries.emplace_back(a, a, 1.0);
  entries.emplace_back(b, b, 1.0);
  entries.emplace_back(a, b, -1.0);
  entries.emplace_back(b, a, -1.0);
}

/// alpha I + G.
Sparse damped_laplacian(const Lattice& lattice, double alpha, const Walls& walls) {
  const int nx = lattice.nx(), ny = lattice.ny();
  Triplets entries;
  entries.reserve(9 * static_cast<std::size_t>(lattice.sites()));
  for (int j = 0; j < ny; ++j) {
    for (int i = 0; i < nx; ++i) {
      const int s = lattice.site(i, j);
      const auto at = static_cast<std::size_t>(s);
      entries.emplace_back(s, s, alpha);
      const bool has_right = lattice.wrap() || i + 1 < nx, has_up = lattice.wrap() || j + 1 < ny;
      if (has_right && (walls.empty() || !walls.right[at])) {
        add_edge(entries, s, lattice.site((i + 1) % nx, j));
      }
      if (has_up && (walls.empty() || !walls.up[at])) {
        add_edge(entries, s, lattice.site(i, (j + 1) % ny));
      }
    }
  }
  Sparse m(lattice.sites(), lattice.sites());
  m.setFromTriplets(entries.begin(), entries.end());
  return m;
}

/// Smallest torus on which a field of this alpha does not see its own images: their covariance
/// falls with exp(-sqrt(alpha) distance).
int unbounded_size(double alpha) {
  return static_cast<int>(std::clamp(40.0 / std::sqrt(alpha), 64.0, 4096.0));
}

}  // namespace

double alpha_of_bandwidth(double sites) { return 2.0 / (sites * sites); }

Sparse prior_precision(const Lattice& lattice, const Theta& theta, const Walls& walls,
                       Boundary boundary) {
  check(theta);
  Sparse q = damped_laplacian(lattice, theta.alpha, walls);
  if (theta.order == 2) q = Sparse(q * q);
  q *= theta.kappa;
  const bool homogeneous = lattice.wrap() && walls.empty();
  if (!homogeneous && boundary == Boundary::corrected) {
    field_core::SparseCholesky factor;
    const Sparse lower = q.triangularView<Eigen::Lower>();
    factor.factorize(lower);
    const double target = site_variance(lattice, theta);
    const Eigen::VectorXd scale = (factor.inverse_diagonal() / target).cwiseSqrt();
    q = scale.asDiagonal() * q * scale.asDiagonal();
  }
  q.makeCompressed();
  return q;
}

double torus_covariance(int nx, int ny, const Theta& theta, int dx, int dy) {
  check(theta);
  std::vector<double> cosines(static_cast<std::size_t>(nx)), phases(cosines);
  for (int k = 0; k < nx; ++k) {
    const double w = 2.0 * kPi * k / nx;
    cosines[static_cast<std::size_t>(k)] = 2.0 - 2.0 * std::cos(w);
    phases[static_cast<std::size_t>(k)] = std::cos(w * dx);
  }
  double sum = 0.0;
  for (int l = 0; l < ny; ++l) {
    const double w = 2.0 * kPi * l / ny;
    const double base = theta.alpha + 2.0 - 2.0 * std::cos(w);
    double row = 0.0;
    for (std::size_t k = 0; k < cosines.size(); ++k) {
      const double root = base + cosines[k];
      row += phases[k] / (theta.order == 2 ? root * root : root);
    }
    sum += row * std::cos(w * dy);
  }
  return sum / (theta.kappa * nx * ny);
}

double site_variance(const Lattice& lattice, const Theta& theta) {
  if (lattice.wrap()) return torus_covariance(lattice.nx(), lattice.ny(), theta, 0, 0);
  check(theta);
  const int n = unbounded_size(theta.alpha);
  return torus_covariance(n, n, theta, 0, 0);
}

double kappa_of_variance(const Lattice& lattice, double alpha, int order, double variance) {
  if (!(variance > 0.0)) throw ParameterError("stddev", "must be > 0");
  return site_variance(lattice, {1.0, alpha, order}) / variance;
}

}  // namespace gmrf_slap
