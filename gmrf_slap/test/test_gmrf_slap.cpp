// The estimator as nodes and replays use it: repeatable, restorable, several robots, bad input.
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "dense_reference.hpp"
#include "field_core/errors.hpp"
#include "gmrf_slap/gmrf_slap.hpp"
#include "small_worlds.hpp"

using namespace gmrf_slap;
using Eigen::Matrix2d;
using Eigen::Vector2d;

namespace {

GmrfSlapParams noisy_world(PositionBelief belief) {
  auto p = test::small_world(12, 9, {test::theta(1.0, 0.2), test::theta(0.2, 0.8)});
  p.fields["b"].mean = 5.0;
  p.position_belief = belief;
  p.particles = 60;
  p.lag = 8;
  p.position_stddev = 0.5;
  p.odometry_noise = {0.02, 0.02, 0.02, 0.02};
  p.initial_pose_x = p.initial_pose_y = 3.0;
  p.initial_cov_xx = p.initial_cov_yy = 0.3;
  p.initial_cov_aa = 0.05;
  return p;
}

double truth(int field, const Vector2d& x) {
  return field == 0 ? std::sin(0.9 * x.x()) : 5.0 + std::cos(0.7 * x.y() + 0.3 * x.x());
}

/// A circle inside the grid, with readings of both fields.
struct Drive {
  field_core::SE2 pose{3.0, 3.0, 0.0};
  field_core::Random random{77};
  int t = 0;
  template <class Estimator>
  field_core::UpdateResult step(Estimator& e) {
    const auto increment = test::motion(0.5, 0.0, 0.2);
    pose = pose * increment.delta;
    e.predict(increment);
    auto sample = test::sample_of({});
    for (int f = 0; f < 2; ++f) {
      if (f == 1 && t % 3 == 0) continue;
      sample.readings.push_back({f, truth(f, pose.translation()) + random.normal(0.0, 0.3), 0.0});
    }
    ++t;
    return e.update(sample);
  }
};

void expect_same(const GmrfSlap& a, const GmrfSlap& b) {
  const auto x = a.belief(), y = b.belief();
  EXPECT_EQ(x.mean.vector(), y.mean.vector());
  EXPECT_EQ(x.covariance, y.covariance);
  ASSERT_EQ(x.particles.size(), y.particles.size());
  for (std::size_t p = 0; p < x.particles.size(); ++p) {
    EXPECT_EQ(x.particles[p].weight, y.particles[p].weight);
    EXPECT_EQ(x.particles[p].pose.vector(), y.particles[p].pose.vector());
  }
  Eigen::Matrix2Xd points(2, 3);
  points << 1.0, 3.3, 7.0, 2.0, 4.1, 8.0;
  const auto p = a.predict_field(points), q = b.predict_field(points);
  EXPECT_EQ(p.mean, q.mean);
  EXPECT_EQ(p.variance, q.variance);
}

class Beliefs : public ::testing::TestWithParam<PositionBelief> {};

TEST_P(Beliefs, FollowTheRobotAndStayPositiveDefinite) {
  auto params = noisy_world(GetParam());
  params.initial_cov_xx = params.initial_cov_yy = params.initial_cov_aa =
      1e-4;  // or the map floats
  GmrfSlap slap(params, 1);
  Drive drive;
  double error = 0.0;
  for (int t = 0; t < 120; ++t) {
    const auto result = drive.step(slap);
    ASSERT_TRUE(result.applied);
    EXPECT_GT(result.nis_dof, 0);
    const auto belief = slap.belief();
    EXPECT_EQ(belief.covariance, belief.covariance.transpose());
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(belief.covariance).eigenvalues()[0],
              0.0);
    error += (belief.mean.translation() - drive.pose.translation()).norm() / 120.0;
  }
  // 60 m of odometry with 0.1 m of noise per metre. Beliefs over sites of 1 m round every 0.5 m:
  // with odometry they follow, but no better than that, and only the Gaussian one knows it.
  if (GetParam() == PositionBelief::trajectories) {
    EXPECT_LT(error, 0.7);
  }
  if (GetParam() != PositionBelief::lattice) {
    const Vector2d off = slap.belief().mean.translation() - drive.pose.translation();
    const Matrix2d spread = slap.belief().covariance.topLeftCorner<2, 2>();
    EXPECT_LT(off.dot(spread.inverse() * off), 20.0);
  }
}

TEST_P(Beliefs, SameSeedSameBits) {
  GmrfSlap a(noisy_world(GetParam()), 5), b(noisy_world(GetParam()), 5);
  Drive x, y;
  for (int t = 0; t < 25; ++t) {
    x.step(a);
    y.step(b);
    if (t % 7 == 0) b.predict_field(Eigen::Vector2d(3.0, 3.0));  // looking changes nothing
  }
  expect_same(a, b);
  a.reset();
  GmrfSlap fresh(noisy_world(GetParam()), 5);
  expect_same(a, fresh);
}

TEST_P(Beliefs, RestoredStateContinuesBitForBit) {
  for (const int steps : {0, 5, 21}) {
    GmrfSlap a(noisy_world(GetParam()), 5);
    Drive x;
    for (int t = 0; t < steps; ++t) x.step(a);
    const field_core::State state = a.state();
    GmrfSlap b(noisy_world(GetParam()), 6);
    Drive other;
    for (int t = 0; t < 3; ++t) other.step(b);
    b.restore(state);
    expect_same(a, b);
    Drive y = x;
    for (int t = 0; t < 20; ++t) {
      x.step(a);
      y.step(b);
    }
    expect_same(a, b);
  }
}

TEST_P(Beliefs, ForeignStatesAreRefusedAndChangeNothing) {
  GmrfSlap a(noisy_world(GetParam()), 5), untouched(noisy_world(GetParam()), 5);
  Drive x, y;
  for (int t = 0; t < 5; ++t) {
    x.step(a);
    y.step(untouched);
  }
  auto larger = noisy_world(GetParam());
  larger.grid.size = {13.0, 9.0};
  EXPECT_THROW(a.restore(GmrfSlap(larger, 1).state()), field_core::DataError);
  EXPECT_THROW(a.restore(field_core::State("gp_localize", 1)), field_core::DataError);
  EXPECT_THROW(a.restore(field_core::State("gmrf_slap", 1)), field_core::DataError);
  expect_same(a, untouched);
}

TEST_P(Beliefs, ARobotOutsideTheGridIsSkippedAndComesBack) {
  auto params = noisy_world(GetParam());
  GmrfSlap slap(params, 1);
  slap.set_pose(field_core::SE2(100.0, 0.0, 0.0), 0.01 * Eigen::Matrix3d::Identity());
  const auto result = slap.update(test::sample_of({{0, 1.0, 0.0}}));
  EXPECT_FALSE(result.applied);
  EXPECT_STREQ(result.reason, "outside the grid");
  EXPECT_EQ(slap.predict_field(Vector2d(3.0, 3.0)).mean(0, 0), 0.0);
  slap.set_pose(field_core::SE2(3.0, 3.0, 0.0), 0.01 * Eigen::Matrix3d::Identity());
  EXPECT_TRUE(slap.update(test::sample_of({{0, 1.0, 0.0}})).applied);
}

TEST_P(Beliefs, APositionObservationFarOffIsRefused) {
  GmrfSlap slap(noisy_world(GetParam()), 1);
  const auto before = slap.belief();
  const double sigma = std::sqrt(before.covariance(0, 0) + 0.25);
  const auto off =
      slap.slap().observe_position(0, before.mean.translation() + Vector2d(100.0 * sigma, 0.0));
  EXPECT_FALSE(off.applied);
  EXPECT_STREQ(off.reason, "position observation off the belief");
  EXPECT_EQ(slap.belief().mean.vector(), before.mean.vector());
  EXPECT_FALSE(slap.slap().observe_position(0, Vector2d(std::nan(""), 0.0)).applied);
  EXPECT_TRUE(slap.slap().observe_position(0, Vector2d(3.4, 3.0)).applied);
  EXPECT_LT(slap.belief().covariance(0, 0), before.covariance(0, 0));
}

TEST_P(Beliefs, TwoRobotsInOneCellShareWhatTheyMeasure) {
  auto params = noisy_world(GetParam());
  params.robots = {"one", "two"};
  params.initial_cov_xx = params.initial_cov_yy = params.initial_cov_aa = 0.0;
  params.lag = 2;
  Slap slap(params, 1);
  for (int t = 0; t < 6; ++t) {
    for (int robot = 0; robot < 2; ++robot) {
      ASSERT_TRUE(slap.update(robot, test::sample_of({{0, 1.5, 0.0}})).applied);
    }
  }
  const auto both = slap.predict_field(Vector2d(3.0, 3.0));
  params.robots = {"one"};
  Slap alone(params, 1);
  for (int t = 0; t < 6; ++t) alone.update(0, test::sample_of({{0, 1.5, 0.0}}));
  const auto one = alone.predict_field(Vector2d(3.0, 3.0));
  EXPECT_LT(both.variance(0, 0), one.variance(0, 0) - 1e-4);
  EXPECT_LT(std::abs(both.mean(0, 0) - 1.5), std::abs(one.mean(0, 0) - 1.5));
}

INSTANTIATE_TEST_SUITE_P(Kinds, Beliefs,
                         ::testing::Values(PositionBelief::trajectories, PositionBelief::lattice,
                                           PositionBelief::gaussian));

/// Two robots on the same grid; what the first believes and the field at a few points.
struct Outcome {
  Eigen::Vector3d mean;
  Eigen::MatrixXd field, variance;
  Eigen::VectorXd theta;
};

Outcome drive_two(GmrfSlapParams params) {
  params.robots = {"one", "two"};
  Slap slap(params, 2);
  slap.set_pose(1, field_core::SE2(8.0, 6.0, 2.0), 1e-4 * Eigen::Matrix3d::Identity());
  field_core::Random random(5);
  for (int t = 0; t < 25; ++t) {
    for (int r = 0; r < 2; ++r) {
      if (r == 1 && t > 4 && t < 15) continue;  // silent for a while
      slap.predict(r, test::motion(0.5, 0.0, 0.25));
      slap.update(r,
                  test::sample_of({{0, random.normal(), 0.0}, {1, random.normal(5.0, 1.0), 0.0}}));
    }
  }
  Eigen::Matrix2Xd points(2, 4);
  points << 3.0, 4.2, 8.0, 11.0, 3.0, 5.1, 6.0, 0.0;
  const auto prediction = slap.predict_field(points);
  return {slap.belief(0).mean.vector(), prediction.mean, prediction.variance,
          slap.hyperparameters()[1].probability};
}

TEST_P(Beliefs, SparseEngineGivesTheSameAnswers) {
  auto params = noisy_world(GetParam());
  const Outcome dense = drive_two(params);
  params.engine = Engine::sparse;
  const Outcome sparse = drive_two(params);
  // 1e-8 of the engines, carried through 25 steps.
  EXPECT_LT((dense.mean - sparse.mean).norm(), 1e-6);
  EXPECT_LT((dense.field - sparse.field).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT((dense.variance - sparse.variance).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT((dense.theta - sparse.theta).cwiseAbs().maxCoeff(), 1e-6);
  params.engine = Engine::local;  // the halo covers this small grid
  const Outcome local = drive_two(params);
  EXPECT_LT((dense.mean - local.mean).norm(), 1e-2);
  EXPECT_LT((dense.field - local.field).cwiseAbs().maxCoeff(), 1e-2);
}

TEST_P(Beliefs, SparseStatesContinueBitForBit) {
  auto params = noisy_world(GetParam());
  params.engine = Engine::sparse;
  GmrfSlap a(params, 5), b(params, 6);
  Drive x;
  for (int t = 0; t < 13; ++t) x.step(a);
  b.restore(a.state());
  Drive y = x;
  for (int t = 0; t < 15; ++t) {
    x.step(a);
    y.step(b);
  }
  expect_same(a, b);
}

TEST(Slap, RobotsThatFallSilentCostAndChangeNothing) {
  auto params = noisy_world(PositionBelief::trajectories);
  Slap one(params, 3);
  params.robots = {"robot1", "silent"};
  Slap two(params, 3);
  for (int t = 0; t < 10; ++t) {
    for (Slap* s : {&one, &two}) {
      s->predict(0, test::motion(0.4, 0.0, 0.2));
      s->update(0, test::sample_of({{0, 0.1 * t, 0.0}}));
    }
  }
  EXPECT_EQ(one.belief(0).mean.vector(), two.belief(0).mean.vector());
}

TEST(Slap, SkipsSayWhy) {
  auto params = noisy_world(PositionBelief::trajectories);
  params.update_min_d = 0.3;
  params.update_min_a = 0.3;
  Slap slap(params, 1);
  EXPECT_STREQ(slap.update(0, test::sample_of({})).reason, "no known field");
  EXPECT_TRUE(slap.update(0, test::sample_of({{0, 1.0, 0.0}})).applied);
  slap.predict(0, test::motion(0.2, 0.0, 0.0));
  EXPECT_STREQ(slap.update(0, test::sample_of({{0, 1.0, 0.0}})).reason, "not moved enough");
  slap.predict(0, test::motion(0.2, 0.0, 0.0));
  EXPECT_TRUE(slap.update(0, test::sample_of({{0, 1.0, 0.0}})).applied);
}

TEST(Slap, MeasurementVarianceZeroMeansTheConfiguredNoise) {
  auto params = noisy_world(PositionBelief::trajectories);
  Slap a(params, 1), b(params, 1);
  a.update(0, test::sample_of({{0, 1.0, 0.0}}));
  b.update(0, test::sample_of({{0, 1.0, 0.09}}));  // measurement_stddev 0.3
  EXPECT_EQ(a.belief(0).mean.vector(), b.belief(0).mean.vector());
}

std::string refusal(const GmrfSlapParams& params) {
  try {
    params.validate();
    GmrfSlap slap(params, 1);
  } catch (const field_core::ParameterError& e) {
    return e.what();
  }
  return "accepted";
}

TEST(GmrfSlap, RefusesWhatCannotWork) {
  const auto good = noisy_world(PositionBelief::trajectories);
  EXPECT_EQ(refusal(good), "accepted");
  auto p = good;
  p.grid.size = {301.0, 301.0};
  // 2 fields x 2 thetas x prior and posterior x 90601^2 x 8 bytes.
  EXPECT_NE(refusal(p).find("'grid/size': 301 x 301 sites need 525"), std::string::npos)
      << refusal(p);
  p = good;
  p.hyperparameters[1].alpha = 1e-9;
  EXPECT_NE(refusal(p).find("singular"), std::string::npos);
  p = good;
  p.hyperparameters.clear();
  EXPECT_NE(refusal(p).find("'fields/a/hyperparameters'"), std::string::npos);
  p = good;
  p.grid.wrap = true;
  p.grid.size = {2.0, 9.0};
  EXPECT_NE(refusal(p).find("torus"), std::string::npos);
  p = good;
  p.robots = {"a", "a"};
  EXPECT_NE(refusal(p).find("twice"), std::string::npos);
  HyperparameterParams mixed = test::theta(1.0, 0.1);
  mixed.bandwidth = 3.0;
  EXPECT_THROW(mixed.validate(), field_core::ParameterError);
}

TEST(GmrfSlap, BandwidthAndStddevAreThoseOfTheField) {
  auto params = noisy_world(PositionBelief::trajectories);
  HyperparameterParams h;
  h.bandwidth = 3.0;
  h.stddev = 2.0;
  params.hyperparameters = {h};
  const GmrfSlap slap(params, 1);
  const auto prediction = slap.predict_field(Vector2d(4.0, 4.0));
  EXPECT_NEAR(prediction.variance(0, 0), 4.0 + 0.09, 1e-9);
  EXPECT_NEAR(prediction.prior_variance[0], 4.0 + 0.09, 1e-9);
  const auto covariance = [&](const Vector2d& a, const Vector2d& b) {
    double out = 0.0;
    const SiteRow x = slap.slap().bank().row(a), y = slap.slap().bank().row(b);
    slap.slap().bank().fields()[0].given[0]->covariances(x, &y, 1, &out);
    return out;
  };
  EXPECT_NEAR(covariance({1.0, 4.0}, {7.0, 4.0}) / 4.0, 0.14, 0.05);
}

}  // namespace
