// The estimator as a whole: its requirements (field_core/estimator.hpp), and the exact cases.
#include <gtest/gtest.h>

#include <cmath>

#include "dense_reference.hpp"
#include "field_core/errors.hpp"
#include "gp_localize/gp_localize.hpp"

using namespace gp_localize;
using field_core::SE2;
using std::chrono::seconds;

namespace {

GpLocalizeParams two_fields() {
  GpLocalizeParams p;
  FieldParams light, heat;
  light.mean = 7.0;
  light.signal_stddev = 2.0;
  light.noise_stddev = 0.3;
  light.length_scales = {1.5, 2.0};
  heat.kernel = field_core::KernelType::matern52;
  heat.mean = 20.0;
  heat.signal_stddev = 1.0;
  heat.noise_stddev = 0.2;
  heat.length_scales = {3.0, 3.0};
  p.fields = {{"light", light}, {"heat", heat}};
  p.particles = 60;
  p.sample_paths = 40;
  p.slice_size = 5;
  p.support.region = {-4.0, -4.0, 8.0, 8.0};
  p.support.size = 25;
  p.initial_cov_xx = p.initial_cov_yy = 0.04;
  p.initial_cov_aa = 0.01;
  p.odometry_noise = {0.02, 0.01, 0.02, 0.01};
  return p;
}

GpLocalizeParams without_noise(GpLocalizeParams p) {
  p.initial_cov_xx = p.initial_cov_yy = p.initial_cov_aa = 0.0;
  p.odometry_noise = {0.0, 0.0, 0.0, 0.0};
  return p;
}

double light_at(const SE2& pose) {
  return 7.0 + 2.0 * std::sin(0.6 * pose.x()) * std::cos(0.5 * pose.y());
}
double heat_at(const SE2& pose) { return 20.0 + std::sin(0.3 * pose.x() + 0.4 * pose.y()); }

// Fields are ordered by name: 0 heat, 1 light.
struct Drive {
  SE2 pose;
  int time = 0;
  field_core::UpdateResult step(GpLocalize& filter, bool with_heat = true) {
    const SE2 delta(0.5, 0.05, 0.35);
    pose = pose * delta;
    filter.predict({seconds(time), seconds(time + 1), delta});
    ++time;
    field_core::Sample sample{seconds(time), {}, {{1, light_at(pose), 0.0}}};
    if (with_heat) sample.readings.push_back({0, heat_at(pose), 0.0});
    return filter.update(sample);
  }
};

class BothMaps : public ::testing::TestWithParam<MapHypotheses> {
 protected:
  GpLocalizeParams params() const {
    GpLocalizeParams p = two_fields();
    p.map_hypotheses = GetParam();
    return p;
  }
};
INSTANTIATE_TEST_SUITE_P(Maps, BothMaps,
                         ::testing::Values(MapHypotheses::sample_paths, MapHypotheses::particle));

TEST_P(BothMaps, WithoutNoiseItIsThePlainFieldModel) {
  const GpLocalizeParams p = without_noise(params());
  GpLocalize filter(p, 1);
  Drive drive;
  Eigen::Matrix2Xd x(2, 18);
  Eigen::VectorXd light(18), heat(18);
  for (int i = 0; i < 18; ++i) {
    ASSERT_TRUE(drive.step(filter).applied);
    x.col(i) = drive.pose.translation();
    light[i] = light_at(drive.pose) - 7.0;
    heat[i] = heat_at(drive.pose) - 20.0;
  }
  EXPECT_NEAR(filter.belief().mean.x(), drive.pose.x(), 1e-12);
  EXPECT_NEAR(filter.belief().mean.yaw(), drive.pose.yaw(), 1e-12);

  std::vector<int> blocks(18);
  for (int i = 0; i < 18; ++i) blocks[i] = i / 5;
  Eigen::Matrix2Xd query(2, 4);
  query << 1.0, 0.0, 3.0, x(0, 17), 0.0, 2.0, -1.0, x(1, 17);
  const auto prediction = filter.predict_field(query);
  const auto models = make_field_models(p);
  for (int f = 0; f < 2; ++f) {
    const auto& basis = models[f].basis;
    const test::DenseField dense{basis.kernel(), basis.support(),
                                 p.support.jitter * basis.kernel().signal_variance(),
                                 models[f].noise_variance};
    for (int q = 0; q < 4; ++q) {
      const auto expected =
          test::block_regression(dense, x, f == 0 ? heat : light, blocks, query.col(q), 3);
      // Jitter 1e-8 leaves the support covariance with condition 1e9: rounding times that.
      EXPECT_NEAR(prediction.mean(f, q), expected.mean + models[f].mean, 1e-7);
      EXPECT_NEAR(prediction.variance(f, q), expected.variance + models[f].noise_variance, 1e-7);
    }
  }
}

TEST_P(BothMaps, PredictsThePriorBeforeAnyMeasurement) {
  GpLocalize filter(params(), 1);
  const auto p = filter.predict_field(Eigen::Matrix2Xd::Constant(2, 1, 3.0));
  EXPECT_NEAR(p.mean(1, 0), 7.0, 1e-12);
  EXPECT_NEAR(p.variance(1, 0), 4.0 + 0.09, 1e-12);
  EXPECT_NEAR(p.variance(1, 0), p.prior_variance[1], 1e-12);
  EXPECT_NEAR(p.prior_variance[0], 1.0 + 0.04, 1e-12);
}

TEST_P(BothMaps, StartsAsTheParametersSay) {
  GpLocalizeParams p = params();
  p.particles = 20000;
  p.sample_paths = 1;
  p.support.size = 1;  // only the start matters here
  p.initial_pose_x = 3.0;
  p.initial_pose_a = -1.0;
  p.initial_cov_xx = 0.25;
  const auto belief = GpLocalize(p, 3).belief();
  // Standard errors of 20000 draws: 0.5 / 141 = 0.0035 and sqrt(2 / 20000) = 1 %; bounds are 4 of
  // them.
  EXPECT_NEAR(belief.mean.x(), 3.0, 0.015);
  EXPECT_NEAR(belief.mean.yaw(), -1.0, 0.003);
  EXPECT_NEAR(belief.covariance(0, 0), 0.25, 0.01);
  EXPECT_NEAR(belief.covariance(1, 1), 0.04, 0.0016);
  EXPECT_NEAR(belief.covariance(0, 1), 0.0, 0.003);
  ASSERT_EQ(belief.particles.size(), 20000u);
}

TEST_P(BothMaps, SameSeedSameBitsOtherSeedOthers) {
  GpLocalize a(params(), 5), b(params(), 5), c(params(), 6);
  Drive da, db, dc;
  for (int i = 0; i < 12; ++i) {
    da.step(a);
    db.step(b);
    dc.step(c);
  }
  EXPECT_EQ(a.belief().mean.vector(), b.belief().mean.vector());
  EXPECT_EQ(a.belief().covariance, b.belief().covariance);
  EXPECT_NE(a.belief().mean.x(), c.belief().mean.x());
}

TEST_P(BothMaps, ResetStartsOverBitForBit) {
  GpLocalize filter(params(), 5);
  Drive first, second;
  for (int i = 0; i < 8; ++i) first.step(filter);
  const auto belief = filter.belief();
  filter.reset();
  for (int i = 0; i < 8; ++i) second.step(filter);
  EXPECT_EQ(filter.belief().mean.vector(), belief.mean.vector());
  EXPECT_EQ(filter.belief().covariance, belief.covariance);
}

TEST_P(BothMaps, RestoredStateGoesOnBitForBit) {
  for (const int steps : {5, 12}) {  // at a slice's end, and within one
    GpLocalize original(params(), 5), copy(params(), 99);
    Drive drive;
    for (int i = 0; i < steps; ++i) drive.step(original);
    copy.restore(original.state());
    Drive same = drive;
    for (int i = 0; i < 9; ++i) {
      const auto a = drive.step(original), b = same.step(copy);
      EXPECT_EQ(a.nis, b.nis);
    }
    EXPECT_EQ(original.belief().mean.vector(), copy.belief().mean.vector());
    EXPECT_EQ(original.belief().stamp, copy.belief().stamp);
    const Eigen::Matrix2Xd query = Eigen::Matrix2Xd::Constant(2, 1, 1.0);
    EXPECT_EQ(original.predict_field(query).mean, copy.predict_field(query).mean);
  }
}

TEST_P(BothMaps, ForeignStatesAreRefusedAndChangeNothing) {
  GpLocalize filter(params(), 5);
  Drive drive;
  for (int i = 0; i < 3; ++i) drive.step(filter);
  const auto before = filter.belief();
  GpLocalizeParams fewer = params();
  fewer.support.size = 9;
  EXPECT_THROW(filter.restore(GpLocalize(fewer, 1).state()), field_core::DataError);
  EXPECT_THROW(filter.restore(field_core::State("vector_field_slam", 1)), field_core::DataError);
  EXPECT_THROW(filter.restore(field_core::State("gp_localize", 99)), field_core::DataError);
  EXPECT_EQ(filter.belief().mean.vector(), before.mean.vector());
}

TEST_P(BothMaps, SkipsWithAReason) {
  GpLocalizeParams p = params();
  p.update_min_d = 0.8;
  GpLocalize filter(p, 1);
  EXPECT_STREQ(filter.update({seconds(0), {}, {}}).reason, "no known field");
  EXPECT_STREQ(filter.update({seconds(0), {}, {{7, 1.0, 0.0}}}).reason, "no known field");
  Drive drive;
  EXPECT_TRUE(drive.step(filter).applied);  // the first counts wherever the robot stands
  EXPECT_STREQ(drive.step(filter).reason, "not moved enough");
  EXPECT_TRUE(drive.step(filter).applied);
}

TEST_P(BothMaps, AnImpossibleMeasurementIsSkippedAndNotLearned) {
  GpLocalize filter(params(), 1);
  Drive drive;
  for (int i = 0; i < 3; ++i) drive.step(filter);
  const Eigen::Matrix2Xd query = Eigen::Matrix2Xd::Constant(2, 1, 1.0);
  const auto map = filter.predict_field(query);
  const auto result = filter.update({seconds(9), {}, {{1, 1e200, 0.0}}});
  EXPECT_FALSE(result.applied);
  EXPECT_STREQ(result.reason, "no particle explains the measurement");
  EXPECT_EQ(filter.predict_field(query).mean, map.mean);
  EXPECT_TRUE(drive.step(filter).applied);
}

TEST_P(BothMaps, FieldsMayBeMissingAtAnyStep) {
  GpLocalize filter(params(), 1);
  Drive drive;
  for (int i = 0; i < 23; ++i) {
    const auto result = drive.step(filter, i % 3 != 0);
    ASSERT_TRUE(result.applied);
    EXPECT_EQ(result.nis_dof, i % 3 != 0 ? 2 : 1);
    const Eigen::LLT<Eigen::Matrix3d> factor(filter.belief().covariance);
    ASSERT_EQ(factor.info(), Eigen::Success);
  }
}

TEST_P(BothMaps, SensorOffTheBaseReadsWhereItIs) {
  // One robot with the sensor 2 m ahead of its base, and one whose base is there: the same map.
  const GpLocalizeParams p = without_noise(params());
  GpLocalizeParams shifted = p;
  shifted.initial_pose_x = 2.0;
  GpLocalize mounted(p, 1), plain(shifted, 1);
  mounted.update({seconds(0), SE2(2.0, 0.0, 0.0), {{1, 9.0, 0.0}}});
  plain.update({seconds(0), SE2(), {{1, 9.0, 0.0}}});
  Eigen::Matrix2Xd query(2, 2);
  query << 2.0, 0.0, 0.0, 0.0;
  EXPECT_EQ(mounted.predict_field(query).mean, plain.predict_field(query).mean);
  EXPECT_GT(mounted.predict_field(query).mean(1, 0), mounted.predict_field(query).mean(1, 1) + 0.5);
}

TEST_P(BothMaps, SetPoseAndScatterKeepTheMap) {
  GpLocalize filter(params(), 1);
  Drive drive;
  for (int i = 0; i < 7; ++i) drive.step(filter);
  Eigen::Matrix2Xd query(2, 1);
  query << drive.pose.x(), drive.pose.y();
  const double known = filter.predict_field(query).variance(1, 0);
  EXPECT_LT(known, 0.5 * filter.predict_field(query).prior_variance[1]);
  filter.set_pose(SE2(1.0, 2.0, 0.5), Eigen::Vector3d(0.01, 0.01, 0.001).asDiagonal());
  EXPECT_NEAR(filter.belief().mean.x(), 1.0, 0.06);  // 4 standard errors of 60 particles
  // The closed slice knows through the support points only: less, but far more than nothing.
  EXPECT_LT(filter.predict_field(query).variance(1, 0), 0.4 * 4.09);
  filter.scatter();
  EXPECT_NEAR(filter.belief().covariance(0, 0), 12.0 * 12.0 / 12.0, 5.0);  // uniform over 12 m
  EXPECT_LT(filter.predict_field(query).variance(1, 0), 0.6 * 4.09);
}

TEST_P(BothMaps, SingleAndDoublePrecisionAgree) {
  GpLocalizeParams single = params(), twice = params();
  twice.precision = Precision::double_precision;
  GpLocalize a(single, 4), b(twice, 4);
  Drive da, db;
  for (int i = 0; i < 6; ++i) {
    const auto ra = da.step(a), rb = db.step(b);
    EXPECT_NEAR(ra.nis, rb.nis, 1e-3 * (1.0 + rb.nis));
  }
  // The same random numbers, weights that differ by 1e-5: no resampling decision flips so early.
  EXPECT_NEAR(a.belief().mean.x(), b.belief().mean.x(), 1e-3);
}

TEST_P(BothMaps, LocalizesBetterThanItsOdometry) {
  constexpr int kSteps = 150, kSeeds = 3;
  double filter_error = 0.0, odometry_error = 0.0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    GpLocalizeParams p = params();
    p.particles = 200;
    p.sample_paths = 100;
    p.initial_cov_xx = p.initial_cov_yy = p.initial_cov_aa = 1e-4;
    p.odometry_noise = {0.01, 0.01, 0.01, 0.01};
    GpLocalize filter(p, seed);
    SE2 truth, odometry;
    for (int t = 0; t < kSteps; ++t) {
      const SE2 delta(0.4, 0.0, 0.2), biased(0.4, 0.0, 0.2 + 0.01);  // gyro drift
      truth = truth * delta;
      odometry = odometry * biased;
      filter.predict({seconds(t), seconds(t + 1), biased});
      filter.update({seconds(t + 1), {}, {{0, heat_at(truth), 0.0}, {1, light_at(truth), 0.0}}});
      filter_error += (filter.belief().mean.translation() - truth.translation()).norm();
      odometry_error += (odometry.translation() - truth.translation()).norm();
    }
  }
  // Measured over other seeds: 0.3 to 0.45 of the odometry's error for either map.
  EXPECT_LT(filter_error, 0.6 * odometry_error);
  // Better than the sensors' noise allows would mean that the filter saw the truth.
  EXPECT_GT(filter_error / (kSteps * kSeeds), 0.03);
}

TEST(GpLocalizeTest, RefusesWhatCannotWork) {
  GpLocalizeParams p = two_fields();
  p.support.selection = SupportSelection::explicit_points;
  EXPECT_THROW(GpLocalize(p, 1), field_core::ParameterError);
  p.support.points = {{0.0, 0.0}, {1.0, 1.0}, {0.0, 0.0}};
  try {
    GpLocalize filter(p, 1);
    FAIL() << "two equal support points were accepted";
  } catch (const field_core::ParameterError& error) {
    EXPECT_NE(std::string(error.what()).find("heat"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("coincide"), std::string::npos);
  }
}

}  // namespace
