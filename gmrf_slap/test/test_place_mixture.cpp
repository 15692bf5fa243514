// Which places of a measurement are left out, how much mass that is, and what groups change.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "gmrf_slap/field_prior.hpp"
#include "gmrf_slap/gaussian_field.hpp"
#include "place_mixture.hpp"

using namespace gmrf_slap;

namespace {

/// Conditions on places at the sites 0, 10, 20, ... with these weights.
std::unique_ptr<GaussianField> conditioned(const std::vector<double>& weights, double prune_mass,
                                           double& left_out) {
  const Lattice lattice({0.0, 0.0}, 1.0, 9, 9, true);
  auto field = make_dense_field(prior_precision(lattice, {2.0, 0.3, 2}));
  PlaceMixture mixture;
  for (std::size_t k = 0; k < weights.size(); ++k) {
    mixture.add({1, {static_cast<int>(10 * k)}, {1.0}}, weights[k], 0.5);
  }
  left_out = mixture.condition(*field, 0.1, {prune_mass, 0.0}).mass;
  return field;
}

TEST(PlaceMixture, LeavesOutTheLightestWithinTheMass) {
  double left_out = 0.0, none = 0.0;
  // 1 + 3 % fit into 5 %, 6 % more do not. Weights need not sum to 1.
  const auto pruned = conditioned({9.0, 0.1, 0.6, 0.3}, 0.05, left_out);
  EXPECT_NEAR(0.04, left_out, 1e-12);
  const auto two = conditioned({9.0, 0.0, 0.6, 0.0}, 0.0, none);
  EXPECT_EQ(0.0, none);
  EXPECT_LT((pruned->mean() - two->mean()).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_LT((pruned->variances() - two->variances()).cwiseAbs().maxCoeff(), 1e-14);
  const auto all = conditioned({9.0, 0.1, 0.6, 0.3}, 0.0, none);
  EXPECT_EQ(0.0, none);
  EXPECT_GT((pruned->mean() - all->mean()).cwiseAbs().maxCoeff(), 1e-4);
}

TEST(PlaceMixture, NeverLeavesOutAll) {
  double left_out = 1.0;
  conditioned({1.0}, 0.1, left_out);
  EXPECT_EQ(0.0, left_out);
  conditioned({1.0, 1.0, 1.0, 1.0}, 0.1, left_out);
  EXPECT_EQ(0.0, left_out);
}

/// A smooth field after a measurement of value z somewhere in its middle, and Sigma of it.
struct Measured {
  Measured(double z, double noise, double merge_loss) {
    const Lattice lattice({0.0, 0.0}, 1.0, 12, 12, false);
    field = make_dense_field(prior_precision(lattice, {1.0, 0.1, 2}));
    PlaceMixture mixture;
    for (int s = 0; s < lattice.sites(); ++s) {
      const Eigen::Vector2d d = lattice.position(s) - Eigen::Vector2d(5.0, 6.0);
      mixture.add({1, {s}, {1.0}}, std::exp(-0.5 * d.squaredNorm() / 4.0), z);
    }
    left_out = mixture.condition(*field, noise, {0.0, merge_loss});
    sigma.resize(lattice.sites(), lattice.sites());
    std::vector<SiteRow> rows;
    for (int s = 0; s < lattice.sites(); ++s) rows.push_back({1, {s}, {1.0}});
    for (int s = 0; s < lattice.sites(); ++s) {
      field->covariances(rows[static_cast<std::size_t>(s)], rows.data(), lattice.sites(),
                         sigma.col(s).data());
    }
  }
  std::unique_ptr<GaussianField> field;
  LeftOut left_out;
  Eigen::MatrixXd sigma;
};

/// Largest change of a variance, in any direction, as a share of what it was before.
double largest_share(const Measured& a, const Measured& b) {
  const Eigen::MatrixXd prior =
      Eigen::MatrixXd(prior_precision(Lattice({0.0, 0.0}, 1.0, 12, 12, false), {1.0, 0.1, 2}))
          .inverse();
  return Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd>(a.sigma - b.sigma, prior,
                                                                   Eigen::EigenvaluesOnly)
      .eigenvalues()
      .cwiseAbs()
      .maxCoeff();
}

TEST(PlaceMixture, GroupsKeepTheMeanAndBoundTheCovariance) {
  // Near 0 every place lowers the variance; near 2 standard deviations some raise it.
  for (const double z : {0.1, 2.0}) {
    const Measured exact(z, 0.05, 0.0), grouped(z, 0.05, 3e-4);
    EXPECT_EQ(exact.left_out.information, 0.0);
    EXPECT_GT(grouped.left_out.information, 0.0);
    EXPECT_LT((grouped.field->mean() - exact.field->mean()).cwiseAbs().maxCoeff(), 1e-13);
    // The loss of a few groups: directions differ.
    EXPECT_LT(largest_share(grouped, exact), 2e-3) << z;
    EXPECT_GT(largest_share(grouped, exact), 1e-5) << z;  // there is something to bound
  }
}

TEST(PlaceMixture, GroupsLeaveTheCovariancePositive) {
  // Hardly any noise and a value ten standard deviations off: nearly all places raise the variance,
  // and Sigma' >= noise/s Sigma is all that is sure; s is below 2.
  const Measured exact(10.0, 1e-6, 0.0), grouped(10.0, 1e-6, 0.1);
  const Eigen::VectorXd spectrum =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(grouped.sigma).eigenvalues();
  EXPECT_GT(spectrum[0], 0.0);
  EXPECT_LT(largest_share(grouped, exact), 0.5e-6 + 1e-9);
}

}  // namespace
