// What the field's update leaves out, over whole runs: it is reported, and it does not decide which
// hyperparameters are believed.
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "dense_reference.hpp"
#include "gmrf_slap/field_prior.hpp"
#include "small_worlds.hpp"

using namespace gmrf_slap;

namespace {

constexpr int kSide = 15;

/// Theta 0 has fields ten times smaller than theta 1. Positions are observed with a noise of 2 m.
GmrfSlapParams two_scales(double merge_loss) {
  GmrfSlapParams p =
      test::small_world(kSide, kSide, {test::theta(50.0, 0.1), test::theta(0.5, 0.1)});
  p.grid.wrap = true;
  p.grid.interpolation = Interpolation::nearest;
  p.position_belief = PositionBelief::lattice;
  p.measurement_stddev = 0.1;
  p.position_stddev = 2.0;
  p.initial_pose_x = p.initial_pose_y = 7.0;
  p.initial_cov_xx = p.initial_cov_yy = 9.0;
  p.prune_mass = merge_loss > 0.0 ? 1e-4 : 0.0;
  p.merge_loss = merge_loss;
  return p;
}

struct Outcome {
  std::vector<double> log_odds;  ///< of theta 1, after each step
  Eigen::VectorXd mean;
  double information = 0.0;  ///< the most that a step left out
};

/// Thirty steps around the middle in a field of theta 0, thirty in one of theta 1.
Outcome run(double merge_loss) {
  Slap slap(two_scales(merge_loss), 1);
  field_core::Random random(4);
  std::vector<Eigen::VectorXd> fields;
  for (const double kappa : {50.0, 0.5}) {
    const Eigen::MatrixXd q = prior_precision(slap.bank().lattice(), {kappa, 0.1, 2});
    fields.push_back(test::draw_field(q.inverse(), random));
  }
  Outcome out;
  Eigen::Vector2d place(7.0, 7.0);
  auto sample = test::sample_of({{0, 0.0, 0.0}});
  for (int t = 0; t < 60; ++t) {
    const Eigen::Vector2d goal(7.0 + std::round(4.0 * std::cos(0.4 * t)),
                               7.0 + std::round(4.0 * std::sin(0.4 * t)));
    slap.displace(0, goal - place, 0.5 * Eigen::Matrix2d::Identity());
    place = goal;
    slap.observe_position(0, place + 2.0 * Eigen::Vector2d(random.normal(), random.normal()));
    sample.readings[0].value =
        fields[t < 30 ? 0 : 1][slap.bank().lattice().nearest(place)] + random.normal(0.0, 0.1);
    EXPECT_TRUE(slap.update(0, sample).applied);
    const Eigen::VectorXd& theta = slap.bank().fields()[0].probability;
    out.log_odds.push_back(std::log(theta[1] / theta[0]));
    out.information = std::max(out.information, slap.left_out_information(0));
  }
  out.mean = slap.site_mean(0);
  return out;
}

TEST(LeftOut, AnUnlikelyThetaComesBack) {
  const Outcome exact = run(0.0), grouped = run(GmrfSlapParams().merge_loss);
  EXPECT_LT(exact.log_odds[29], std::log(1e-6));
  EXPECT_LT(grouped.log_odds[29], std::log(1e-6));
  EXPECT_GT(exact.log_odds[59], std::log(1e6));
  EXPECT_GT(grouped.log_odds[59], std::log(1e6));
  for (std::size_t t = 0; t < 60; ++t) {
    EXPECT_NEAR(exact.log_odds[t], grouped.log_odds[t], 0.02 * std::abs(exact.log_odds[t]) + 0.1)
        << t;
  }
  // Fields of theta 1 have a standard deviation of 1.3.
  EXPECT_LT((exact.mean - grouped.mean).cwiseAbs().maxCoeff(), 0.05);
  EXPECT_EQ(exact.information, 0.0);
  EXPECT_GT(grouped.information, 1e-3);
  EXPECT_LT(grouped.information, 1.0);
}

TEST(LeftOut, GroupsAreTheSameForDenseAndSparse) {
  GmrfSlapParams p = two_scales(GmrfSlapParams().merge_loss);
  Slap dense(p, 1);
  p.engine = Engine::sparse;
  Slap sparse(p, 1);
  auto sample = test::sample_of({{0, 0.0, 0.0}});
  for (int t = 0; t < 8; ++t) {
    sample.readings[0].value = 0.2 * std::sin(0.5 * t);
    for (Slap* slap : {&dense, &sparse}) {
      slap->displace(0, {t < 4 ? 1.0 : -1.0, 0.3}, 0.5 * Eigen::Matrix2d::Identity());
      slap->observe_position(0, {7.0, 7.0});
      EXPECT_TRUE(slap->update(0, sample).applied);
    }
    EXPECT_GT(dense.left_out_information(0), 0.0);
    EXPECT_NEAR(dense.left_out_information(0), sparse.left_out_information(0), 1e-8);
  }
  for (std::size_t l = 0; l < 2; ++l) {
    const auto &a = *dense.bank().fields()[0].given[l], &b = *sparse.bank().fields()[0].given[l];
    EXPECT_LT((a.mean() - b.mean()).cwiseAbs().maxCoeff(), 1e-8);
    EXPECT_LT((a.variances() - b.variances()).cwiseAbs().maxCoeff(), 1e-8);
  }
}

}  // namespace
