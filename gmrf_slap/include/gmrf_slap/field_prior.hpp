// The Gaussian Markov random field before any measurement: z ~ N(mean, Q^-1) on a lattice.
//
// The SPDE link (Lindgren, Rue, Lindstrom 2011) with order 1 and 2 (their "alpha"), written with
// the paper's parameters theta = (kappa, alpha): with the Laplacian G of the lattice's graph
// (degree on the diagonal, -1 for each edge),
//
//   Q = kappa (alpha I + G)^order.
//
// On the torus the degree is 4 and order 2 is the paper's kappa ((4 + alpha) I - Adjacency)^2:
// kappa x {4 + a^2 in the centre, -2 a for four neighbours, 2 for diagonals, 1 at distance two},
// a = 4 + alpha. On a bounded lattice sites at the edge have fewer neighbours, which is Neumann's
// condition: the field there varies up to twice (corner: four times) as much. `corrected` rescales
// the field site by site to the variance of the unbounded lattice, Q' = D^-1 Q D^-1, which keeps
// the pattern. Walls are edges left out of the graph: no correlation passes through them.
//
// The continuous formulas, bandwidth l = sqrt(2 / alpha) and variance 1 / (4 pi alpha kappa), hold
// for bandwidths well above the spacing and domains well above the bandwidth only: variances here
// are always those of the lattice itself.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "gmrf_slap/lattice.hpp"
#include "gmrf_slap/walls.hpp"

namespace gmrf_slap {

/// theta of the paper, in lattice units: kappa [1/field unit^2], alpha [1]. order: 1 or 2.
struct Theta {
  double kappa = 50.0;
  double alpha = 0.1;
  int order = 2;
};

/// alpha of a bandwidth given in sites: 2 / l^2 (the paper: l = sqrt(2) / sqrt(alpha)).
double alpha_of_bandwidth(double sites);

enum class Boundary { corrected, free };

/// Q, both triangles, compressed. O(sites); with `corrected` on a bounded lattice one sparse
/// factorization and its selected inverse.
/// @throws ParameterError for parameters that are not positive or make Q numerically singular
Eigen::SparseMatrix<double> prior_precision(const Lattice& lattice, const Theta& theta,
                                            const Walls& walls = {},
                                            Boundary boundary = Boundary::corrected);

/// Exact covariance of two sites (dx, dy) apart on an nx x ny torus: the sum over its spectrum,
/// lambda = kappa (alpha + 4 - 2 cos w1 - 2 cos w2)^order. O(nx ny).
double torus_covariance(int nx, int ny, const Theta& theta, int dx, int dy);

/// Exact variance of one site of the torus, or of the unbounded lattice (wrap: false; a torus so
/// large that its images do not matter). What `corrected` gives every site.
double site_variance(const Lattice& lattice, const Theta& theta);

/// The kappa for which site_variance is `variance` [field unit^2].
double kappa_of_variance(const Lattice& lattice, double alpha, int order, double variance);

}  // namespace gmrf_slap
