// The precision matrix against the theory: the paper's stencil, the torus' spectrum, the dense
// inverse, the Matern function that the SPDE stands for.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "field_core/errors.hpp"
#include "gmrf_slap/field_prior.hpp"

using namespace gmrf_slap;
using Eigen::MatrixXd;

namespace {

const Lattice kPaper({-15.0, -15.0}, 1.0, 31, 31, true);

MatrixXd covariance(const Lattice& lattice, const Theta& theta, const Walls& walls = {},
                    Boundary boundary = Boundary::corrected) {
  return MatrixXd(prior_precision(lattice, theta, walls, boundary)).inverse();
}

TEST(FieldPrior, HasThePapersStencil) {
  const Theta theta{50.0, 0.1, 2};
  const MatrixXd q = MatrixXd(prior_precision(kPaper, theta));
  const double a = 4.1;
  const auto entry = [&](int dx, int dy) {
    return q(kPaper.site(0, 0), kPaper.site((dx + 31) % 31, (dy + 31) % 31)) / 50.0;
  };
  EXPECT_NEAR(entry(0, 0), 4.0 + a * a, 1e-12);
  EXPECT_NEAR(entry(1, 0), -2.0 * a, 1e-12);
  EXPECT_NEAR(entry(0, -1), -2.0 * a, 1e-12);
  EXPECT_NEAR(entry(1, 1), 2.0, 1e-12);
  EXPECT_NEAR(entry(-2, 0), 1.0, 1e-12);
  EXPECT_EQ(entry(2, 1), 0.0);
  EXPECT_EQ((q.row(0).array() != 0.0).count(), 13);
}

TEST(FieldPrior, TorusCovarianceIsTheSumOverItsSpectrum) {
  const Lattice lattice({0.0, 0.0}, 1.0, 9, 7, true);
  for (const int order : {1, 2}) {
    const Theta theta{3.0, 0.2, order};
    const MatrixXd sigma = covariance(lattice, theta);
    for (int dy = 0; dy < 7; ++dy) {
      for (int dx = 0; dx < 9; ++dx) {
        EXPECT_NEAR(torus_covariance(9, 7, theta, dx, dy), sigma(0, lattice.site(dx, dy)), 1e-12);
      }
    }
  }
}

TEST(FieldPrior, PaperVarianceIsThatOfTheLatticeNotOfTheContinuum) {
  // Slow dense references gave 0.01666 against 1 / (4 pi alpha kappa) = 0.01592, and 0.263 against
  // 0.159 for a tenth of alpha, where the torus is smaller than the field's range.
  EXPECT_NEAR(site_variance(kPaper, {50.0, 0.1, 2}), 0.01666, 5e-6);
  EXPECT_NEAR(site_variance(kPaper, {50.0, 0.01, 2}), 0.263, 5e-4);
}

TEST(FieldPrior, CorrelationIsMaternOnTheUnboundedLattice) {
  // Order 2 in the plane: correlation x K_1(x), x = sqrt(alpha) distance (Whittle 1954). With a
  // bandwidth of 12 sites the lattice follows within a percent; the logarithm at the origin of
  // order 1 has no limit and is not compared.
  const double alpha = alpha_of_bandwidth(12.0);
  const Theta theta{1.0, alpha, 2};
  const double v = torus_covariance(500, 500, theta, 0, 0);
  EXPECT_NEAR(v, 1.0 / (4.0 * M_PI * alpha), 0.01 * v);
  for (const int d : {3, 6, 12, 24}) {
    const double x = std::sqrt(alpha) * d;
    const double matern = x * std::cyl_bessel_k(1.0, x);
    EXPECT_NEAR(torus_covariance(500, 500, theta, d, 0) / v, matern, 0.01) << d;
    EXPECT_NEAR(torus_covariance(500, 500, theta, 0, d) / v, matern, 0.01) << d;
  }
  // The "range" of the SPDE literature, sqrt(8) / sqrt(alpha): twice the paper's bandwidth.
  const double range = torus_covariance(500, 500, theta, 24, 0) / v;
  EXPECT_NEAR(range, 0.14, 0.01);
}

TEST(FieldPrior, VarianceAndBandwidthAreParameters) {
  for (const bool wrap : {true, false}) {
    for (const int order : {1, 2}) {
      const Lattice lattice({0.0, 0.0}, 0.5, 16, 12, wrap);
      const double alpha = alpha_of_bandwidth(2.0 / 0.5);
      const double kappa = kappa_of_variance(lattice, alpha, order, 6.25);
      const MatrixXd sigma = covariance(lattice, {kappa, alpha, order});
      EXPECT_LT((sigma.diagonal().array() - 6.25).abs().maxCoeff(), 1e-8) << wrap << order;
    }
  }
}

TEST(FieldPrior, FreeBoundariesRaiseTheVarianceAndCorrectionTakesItBack) {
  const Lattice lattice({0.0, 0.0}, 1.0, 40, 40, false);
  const Theta theta{1.0, 0.2, 2};
  const double unbounded = site_variance(lattice, theta);
  const MatrixXd free = covariance(lattice, theta, {}, Boundary::free);
  const int middle = lattice.site(20, 20), edge = lattice.site(20, 0), corner = 0;
  // Neumann's condition mirrors the field half a spacing outside the last site: an edge site has
  // one image one site away, a corner has two and one across the diagonal. 40 sites of 3 hide the
  // rest.
  const double next = torus_covariance(200, 200, theta, 1, 0);
  const double diagonal = torus_covariance(200, 200, theta, 1, 1);
  EXPECT_NEAR(free(middle, middle) / unbounded, 1.0, 1e-5);
  EXPECT_NEAR(free(edge, edge), unbounded + next, 1e-5 * unbounded);
  EXPECT_NEAR(free(corner, corner), unbounded + 2.0 * next + diagonal, 1e-5 * unbounded);
  const MatrixXd corrected = covariance(lattice, theta);
  EXPECT_LT((corrected.diagonal().array() / unbounded - 1.0).abs().maxCoeff(), 1e-9);
  // Correlations are those of the free field.
  EXPECT_NEAR(corrected(edge, edge + 1) / unbounded,
              free(edge, edge + 1) / std::sqrt(free(edge, edge) * free(edge + 1, edge + 1)), 1e-10);
}

TEST(FieldPrior, RefusesSingularParameters) {
  const auto error = [](const Theta& theta) -> std::string {
    try {
      prior_precision(kPaper, theta);
    } catch (const field_core::ParameterError& e) {
      return e.what();
    }
    return "accepted";
  };
  EXPECT_NE(error({0.0, 0.1, 2}).find("'kappa': 0 makes the precision matrix singular"),
            std::string::npos);
  EXPECT_NE(error({1.0, 0.0, 2}).find("'alpha': 0 makes"), std::string::npos);
  EXPECT_NE(error({1.0, 1e-7, 2}).find("larger alpha"), std::string::npos);
  EXPECT_EQ(error({1.0, 1e-7, 1}), "accepted");  // order 1 has the square root of its condition
  EXPECT_NE(error({1.0, 0.1, 3}).find("'order'"), std::string::npos);
}

}  // namespace
