// Correlated fields in the whole estimator: what they teach each other, and runs in a world whose
// fields are correlated.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <Eigen/Dense>
#include <cmath>
#include <filesystem>
#include <functional>

#include "correlated_reference.hpp"
#include "correlated_world.hpp"
#include "gp_localize/gp_localize.hpp"
#include "gp_localize/survey.hpp"

using namespace gp_localize;
using field_core::SE2;
using std::chrono::seconds;

namespace {

class BothMaps : public ::testing::TestWithParam<MapHypotheses> {};
INSTANTIATE_TEST_SUITE_P(Maps, BothMaps,
                         ::testing::Values(MapHypotheses::sample_paths, MapHypotheses::particle));

/// Where nothing but the arithmetic differs: small steps, so that no draw falls on another side.
TEST_P(BothMaps, WithoutCorrelationTheyAreIndependent) {
  GpLocalizeParams p = params(0.0);
  p.map_hypotheses = GetParam();
  p.particles = p.sample_paths = 40;
  p.precision = Precision::double_precision;
  p.interpolation_tolerance = 0.0;
  GpLocalize group(p, 3);
  p.coregionalization.clear();
  GpLocalize alone(p, 3);
  World one(4), other(4);
  EXPECT_NEAR(one.run(group, 20), other.run(alone, 20), 1e-6);
  Eigen::Matrix2Xd query = Eigen::Matrix2Xd::Random(2, 5) * 3.0;
  const auto a = group.predict_field(query), b = alone.predict_field(query);
  EXPECT_LT((a.mean - b.mean).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT((a.variance - b.variance).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT((a.prior_variance - b.prior_variance).cwiseAbs().maxCoeff(), 1e-12);
}

test::CorrelatedFields dense_fields(const GpLocalizeParams& p) {
  test::CorrelatedFields dense;
  dense.b.resize(2, 2);
  dense.b << 4.0, 2.0 * kCorrelation, 2.0 * kCorrelation, 1.0;
  dense.lengths << kLength, kLength;
  dense.support = make_field_models(p)[0].basis.support();
  dense.jitter = p.support.jitter;
  return dense;
}

using ReadAt = std::function<std::vector<test::Read>(int step, const Eigen::Vector2d& at)>;

/// A filter with exact odometry drives a circle and gets the readings of `read_at`; all of them,
/// and where it ends.
std::vector<test::Read> drive(GpLocalize& filter, int steps, const ReadAt& read_at, SE2& pose) {
  std::vector<test::Read> all;
  for (int t = 0; t < steps; ++t) {
    const SE2 delta(0.3, 0.0, 0.15);
    pose = pose * delta;
    filter.predict({seconds(t), seconds(t + 1), delta});
    field_core::Sample sample{seconds(t + 1), {}, {}};
    for (const test::Read& read : read_at(t, pose.translation())) {
      sample.readings.push_back({read.field, read.value + (read.field == 0 ? 5.0 : -3.0), 0.0});
      all.push_back(read);
    }
    EXPECT_TRUE(filter.update(sample).applied);
  }
  return all;
}

/// An exact path, one slice: the group is the dense Gaussian process over places and fields.
TEST_P(BothMaps, OneFieldTeachesTheOther) {
  GpLocalizeParams p = params(0.999);
  p.map_hypotheses = GetParam();
  p.slice_size = 30;
  p.initial_cov_xx = p.initial_cov_yy = p.initial_cov_aa = 0.0;
  p.odometry_noise = {0.0, 0.0, 0.0, 0.0};
  p.particles = p.sample_paths = 8;
  p.precision = Precision::double_precision;
  GpLocalize filter(p, 1);
  test::CorrelatedFields dense;
  dense.b.resize(2, 2);
  dense.b << 4.0, 2.0 * 0.999, 2.0 * 0.999, 1.0;
  dense.lengths << kLength, kLength;
  dense.support = Eigen::Vector2d(0.0, 0.0);  // plays no part in one block
  const World world(2);
  const ReadAt only_a = [&](int, const Eigen::Vector2d& at) {
    return std::vector<test::Read>{{at, 0, world.a(at) - 5.0, kNoise * kNoise, 0}};
  };
  SE2 pose;
  const std::vector<test::Read> reads = drive(filter, 25, only_a, pose);
  const Eigen::Vector2d query = pose.translation() + Eigen::Vector2d(0.1, 0.2);
  const auto predicted = filter.predict_field(query);
  const auto expected = dense.regress(reads, query, {0, 1}, 0);
  for (int f : {0, 1}) {
    EXPECT_NEAR(expected.mean[f] + (f == 0 ? 5.0 : -3.0), predicted.mean(f, 0), 1e-6);
    EXPECT_NEAR(expected.covariance(f, f) + kNoise * kNoise, predicted.variance(f, 0), 1e-6);
  }
  EXPECT_LT(predicted.variance(1, 0) - kNoise * kNoise, 0.05);  // b was never read; 1 before
  EXPECT_NEAR(predicted.mean(1, 0) + 3.0, 0.5 * (predicted.mean(0, 0) - 5.0), 0.02);
  // Both at once, where b contradicts a: innovations of their joint density.
  filter.predict({seconds(25), seconds(26), SE2(0.3, 0.0, 0.15)});
  const Eigen::Vector2d at = (pose * SE2(0.3, 0.0, 0.15)).translation();
  const auto result = filter.update({seconds(26), {}, {{1, -2.5, 0.0}, {0, 5.5, 0.0}}});
  auto joint = dense.regress(reads, at, {0, 1}, 0);
  joint.covariance.diagonal().array() += kNoise * kNoise;
  const Eigen::Vector2d error = Eigen::Vector2d(0.5, 0.5) - joint.mean;
  EXPECT_NEAR(error.dot(joint.covariance.ldlt().solve(error)), result.nis, 1e-5);
  EXPECT_EQ(2, result.nis_dof);
}

/// FITC is PITC whose slices are single steps: both fields of a step are one block.
TEST(CorrelatedFields, FitcTakesStepsAsIndependent) {
  GpLocalizeParams p = params();
  p.observation_model = ObservationModelType::fitc;
  p.initial_cov_xx = p.initial_cov_yy = p.initial_cov_aa = 0.0;
  p.odometry_noise = {0.0, 0.0, 0.0, 0.0};
  p.particles = 4;
  p.support.size = 25;
  GpLocalize filter(p, 1);
  const test::CorrelatedFields dense = dense_fields(p);
  const World world(2);
  const ReadAt both = [&](int t, const Eigen::Vector2d& at) {
    const double a = world.a(at) - 5.0;
    return std::vector<test::Read>{{at, 0, a, kNoise * kNoise, t},
                                   {at, 1, 0.5 * a + 0.1 * (t % 3), kNoise * kNoise, t}};
  };
  SE2 pose;
  const std::vector<test::Read> reads = drive(filter, 20, both, pose);
  const Eigen::Vector2d query = pose.translation() + Eigen::Vector2d(0.3, -0.2);
  const auto predicted = filter.predict_field(query);
  const auto expected = dense.regress(reads, query, {0, 1}, -1);
  for (int f : {0, 1}) {
    EXPECT_NEAR(expected.mean[f] + (f == 0 ? 5.0 : -3.0), predicted.mean(f, 0), 1e-5);
    EXPECT_NEAR(expected.covariance(f, f) + kNoise * kNoise, predicted.variance(f, 0), 1e-5);
  }
}

TEST_P(BothMaps, ARunEndsNearTheTruth) {
  GpLocalizeParams p = params();
  p.map_hypotheses = GetParam();
  World world(6);
  GpLocalize filter(p, 1);
  EXPECT_LT(world.run(filter, 60), 0.5);
  GpLocalize restored(p, 2);
  restored.restore(filter.state());
  World same = world;
  EXPECT_EQ(world.run(filter, 10), same.run(restored, 10));
  const Eigen::Vector2d query(1.0, 1.0);
  EXPECT_EQ(filter.predict_field(query).mean, restored.predict_field(query).mean);
}

/// PITC of the survey in slices of 50 readings of each field, by dense matrices.
test::JointMoments survey_regression(const GpLocalizeParams& p, const Eigen::Vector2d& query) {
  const FieldSurvey all = merge(read_survey(p.survey, {}), {"a", "b"});
  const test::CorrelatedFields dense = dense_fields(p);
  std::vector<test::Read> reads;
  for (Eigen::Index i = 0; i < all.values.size(); ++i) {
    const int f = static_cast<int>(all.places(2, i));
    reads.push_back({all.places.col(i).head<2>(), f, all.values[i] - (f == 0 ? 5.0 : -3.0),
                     kNoise * kNoise, static_cast<int>(i) / 100});
  }
  return dense.regress(reads, query, {0}, -1);
}

TEST(CorrelatedFields, AKnownMapIsThatOfTheSurveyOfBoth) {
  std::string name = (std::filesystem::temp_directory_path() / "correlated.XXXXXX").string();
  const std::string folder = ::mkdtemp(name.data());
  GpLocalizeParams p = params();
  p.survey = folder + "/survey.csv";
  for (const Mode mode : {Mode::localization, Mode::lifelong}) {
    World world(8);
    world.write_survey(p.survey);
    p.mode = mode;
    p.support.budget = mode == Mode::lifelong ? 20 : 0;  // grown where the robot leaves it
    p.field_offset.stddev = mode == Mode::localization ? 0.1 : 0.0;
    GpLocalize filter(p, 1);
    const Eigen::Vector2d query(-4.0, -2.0);  // of row 0, where a was not measured
    const auto predicted = filter.predict_field(query);
    EXPECT_NEAR(world.a(query), predicted.mean(0, 0), 3.0 * std::sqrt(predicted.variance(0, 0)));
    const auto expected = survey_regression(p, query);
    EXPECT_NEAR(expected.mean[0] + 5.0, predicted.mean(0, 0), 1e-5);
    EXPECT_NEAR(expected.covariance(0, 0) + kNoise * kNoise, predicted.variance(0, 0), 1e-6);
    GpLocalizeParams independent = p;
    independent.coregionalization.clear();
    EXPECT_LT(predicted.variance(0, 0),
              GpLocalize(independent, 1).predict_field(query).variance(0, 0));
    EXPECT_LT(world.run(filter, 40), 0.3);
  }
  std::filesystem::remove_all(folder);
}

/// Where it helps: the robot reads b, which was surveyed at 15 places; a was at 192.
TEST(CorrelatedFields, AWellSurveyedFieldStandsInForTheOther) {
  std::string name = (std::filesystem::temp_directory_path() / "correlated.XXXXXX").string();
  const std::string folder = ::mkdtemp(name.data());
  constexpr double kStrong = 0.95;
  constexpr int kSeeds = 20;
  GpLocalizeParams group = params(kStrong);
  group.mode = Mode::localization;
  group.survey = folder + "/survey.csv";
  GpLocalizeParams independent = group;
  independent.coregionalization.clear();
  double together = 0.0, alone = 0.0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    World world(100 + seed, kStrong);
    world.write_survey(group.survey, 20);
    World same = world;
    GpLocalize a(group, seed), b(independent, seed);
    together += world.run(a, 80, true) / kSeeds;
    alone += same.run(b, 80, true) / kSeeds;
  }
  std::filesystem::remove_all(folder);
  RecordProperty("error_group_m", std::to_string(together));
  RecordProperty("error_independent_m", std::to_string(alone));
  EXPECT_LT(together, 0.7 * alone);  // errors of single runs spread by a factor of two
}

/// Candidates multiply all fields of a group: with an exact path and one slice the weights are the
/// dense joint likelihood.
TEST(CorrelatedFields, CandidatesAreWeighedByTheJointLikelihood) {
  GpLocalizeParams p = params();
  p.candidates.signal = {1.0, 1.5};
  p.candidates.noise = {0.7, 1.0};
  p.candidates.length_scales = {0.8, 1.0};
  p.particles = 8;
  p.slice_size = 12;
  p.resample_threshold = 0.0;
  p.initial_cov_xx = p.initial_cov_yy = p.initial_cov_aa = 0.0;
  p.odometry_noise = {0.0, 0.0, 0.0, 0.0};
  GpLocalize filter(p, 1);
  const World world(3);
  std::vector<test::Read> reads;
  SE2 pose;
  for (int t = 0; t < 10; ++t) {
    const SE2 delta(0.3, 0.0, 0.15);
    pose = pose * delta;
    filter.predict({seconds(t), seconds(t + 1), delta});
    const Eigen::Vector2d at = pose.translation();
    ASSERT_TRUE(filter.update({seconds(t + 1), {}, {{0, world.a(at), 0.0}, {1, world.b(at), 0.0}}})
                    .applied);
    reads.push_back({at, 0, world.a(at) - 5.0, 0.0, 0});
    reads.push_back({at, 1, world.b(at) + 3.0, 0.0, 0});
  }
  const auto n = static_cast<Eigen::Index>(reads.size());
  Eigen::VectorXd expected(8), z(n);
  for (int c = 0; c < 8; ++c) {
    const double signal = p.candidates.signal[c / 4], noise = p.candidates.noise[c / 2 % 2];
    test::CorrelatedFields dense;
    dense.b.resize(2, 2);
    dense.b << 4.0, 2.0 * kCorrelation, 2.0 * kCorrelation, 1.0;
    dense.b *= signal * signal;
    dense.lengths.setConstant(p.candidates.length_scales[c % 2] * kLength);
    test::JointMoments moments{Eigen::VectorXd::Zero(n), Eigen::MatrixXd(n, n)};
    for (Eigen::Index i = 0; i < n; ++i) {
      z[i] = reads[i].value;
      for (Eigen::Index j = 0; j < n; ++j) {
        moments.covariance(i, j) = dense.k(reads[i].x, reads[i].field, reads[j].x, reads[j].field);
      }
    }
    expected[c] =
        test::log_density(moments, z, Eigen::VectorXd::Constant(n, std::pow(noise * kNoise, 2)));
  }
  expected = (expected.array() - expected.maxCoeff()).exp();
  expected /= expected.sum();
  const auto posteriors = filter.hyperparameters();
  ASSERT_EQ(2u, posteriors.size());
  for (const auto& posterior : posteriors) {
    EXPECT_LT((posterior.probability - expected).cwiseAbs().maxCoeff(), 1e-7);
  }
  EXPECT_NEAR(1.5, posteriors[1].values(3, 7), 1e-12);  // signal_stddev of b: 1 times 1.5
}

}  // namespace
