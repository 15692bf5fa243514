// Which places of a measurement are left out, and how much mass that is.
#include <gtest/gtest.h>

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

}  // namespace
