// A survey made under other conditions: the field is correlated with what the survey saw. Expected
// values from the joint Gaussian of survey and run, with dense matrices.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "../src/particle_map.hpp"
#include "dense_reference.hpp"
#include "exact_drive.hpp"
#include "gp_localize/field_model.hpp"
#include "gp_localize/survey.hpp"

using namespace gp_localize;
using field_core::SE2;
using std::chrono::seconds;

namespace {

constexpr int kRows = 40;  // one block of PITC
constexpr int kSteps = 2 * kSlice;

double before(const Eigen::Vector2d& p) {
  return 3.0 + std::sin(1.1 * p.x()) * std::cos(0.7 * p.y());
}
double now(const Eigen::Vector2d& p) { return before(p) + 0.5 * std::cos(0.9 * p.x() + p.y()); }

class SurveyCorrelation : public ::testing::Test {
 protected:
  SurveyCorrelation() {
    std::string name = (std::filesystem::temp_directory_path() / "correlation.XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    std::ofstream csv(folder_ + "/survey.csv");
    csv << "x_m,y_m,light\n";
    for (int i = 0; i < kRows; ++i) {
      const Eigen::Vector2d p(-2.8 + 0.8 * (i % 8), -0.7 + 1.1 * (i / 8));
      csv << p.x() << "," << p.y() << "," << before(p) + 0.1 * std::sin(13.0 * i) << "\n";
    }
  }
  ~SurveyCorrelation() override { std::filesystem::remove_all(folder_); }

  GpLocalizeParams params() const {
    GpLocalizeParams p = exact_params();
    p.survey = folder_ + "/survey.csv";
    p.survey_correlation = 0.9;
    p.particles = 1;
    return p;
  }

  std::string folder_;
};

test::DenseField dense_field(const FieldModel& model, const GpLocalizeParams& p) {
  return {model.basis.kernel(), model.basis.support(),
          p.support.jitter * model.basis.kernel().signal_variance(), model.noise_variance};
}

// f = rho f_survey + sqrt(1 - rho^2) g: mean rho times that of f_survey, and of its variance only
// the share rho^2 is reduced.
TEST_F(SurveyCorrelation, PriorIsTheConditionalOfTheJointGaussian) {
  for (const double rho : {0.0, 0.6, 1.0}) {
    GpLocalizeParams p = params();
    p.survey_correlation = rho;
    GpLocalize filter(p, 1);
    const FieldModel model = make_field_models(p)[0];
    const FieldSurvey all = read_survey(p.survey, {"light"}).at("light");
    Eigen::Matrix2Xd query(2, 2);
    query << 0.3, 1.7, 1.1, 2.2;
    const auto prediction = filter.predict_field(query);
    for (int q = 0; q < 2; ++q) {
      const auto known =
          test::block_regression(dense_field(model, p), all.places, all.values.array() - 3.0,
                                 std::vector<int>(kRows, 0), query.col(q), -1);
      const double prior = model.signal_variance();
      EXPECT_NEAR(prediction.mean(0, q), 3.0 + rho * known.mean, 1e-5);
      EXPECT_NEAR(prediction.variance(0, q),
                  prior - rho * rho * (prior - known.variance) + model.noise_variance, 1e-6);
    }
  }
}

/// log N of the run's readings given the survey: PITC with the survey as one block and the run in
/// slices, all of one joint Gaussian in which survey and run have rho times the covariance.
double log_evidence(const test::DenseField& f, double rho, const FieldSurvey& survey,
                    const Eigen::Matrix2Xd& places, const Eigen::VectorXd& values) {
  const Eigen::Index s = survey.values.size(), n = values.size();
  Eigen::Matrix2Xd x(2, s + n);
  x << survey.places, places;
  Eigen::VectorXd z(s + n);
  z << survey.values.array() - 3.0, values.array() - 3.0;
  Eigen::MatrixXd cov = test::gamma(f, x, x);
  const auto block = [s](Eigen::Index i) { return i < s ? -1 : (i - s) / kSlice; };
  for (Eigen::Index i = 0; i < s + n; ++i) {
    for (Eigen::Index j = 0; j < s + n; ++j) {
      if (block(i) == block(j)) cov(i, j) = f.k(x.col(i), x.col(j));
      if ((i < s) != (j < s)) cov(i, j) *= rho;
    }
    cov(i, i) += f.noise_variance;
  }
  const auto log_density = [](const Eigen::MatrixXd& c, const Eigen::VectorXd& v) {
    const Eigen::LDLT<Eigen::MatrixXd> factor(c);
    return -0.5 * (factor.vectorD().array().log().sum() + v.dot(factor.solve(v)));
  };
  return log_density(cov, z) - log_density(cov.topLeftCorner(s, s), z.head(s));
}

TEST_F(SurveyCorrelation, IsLearnedFromTheEvidence) {
  GpLocalizeParams p = params();
  p.candidates.survey_correlation = {0.2, 0.8, 1.0};
  p.candidates.noise = {0.5, 1.0};
  p.particles = 6;
  GpLocalize filter(p, 1);
  Eigen::Matrix2Xd places(2, kSteps);
  Eigen::VectorXd values(kSteps);
  SE2 pose;
  for (int t = 0; t < kSteps; ++t) {
    pose = pose * exact_motion(t);
    places.col(t) = pose.translation();
    values[t] = now(pose.translation()) + 0.1 * std::sin(17.0 * t);
    filter.predict({seconds(t), seconds(t + 1), exact_motion(t)});
    ASSERT_TRUE(filter.update({seconds(t + 1), {}, {{0, values[t], 0.0}}}).applied);
  }
  const auto posterior = filter.hyperparameters().at(0);
  ASSERT_EQ(posterior.names.back(), "survey_correlation");
  const FieldSurvey survey = read_survey(p.survey, {"light"}).at("light");
  const FieldModel model = make_field_models(p)[0];
  Eigen::VectorXd expected(6);
  for (int c = 0; c < 6; ++c) {
    test::DenseField f = dense_field(model, p);
    f.noise_variance = std::pow(posterior.values(2, c), 2);
    expected[c] = log_evidence(f, posterior.values(4, c), survey, places, values);
  }
  expected = (expected.array() - expected.maxCoeff()).exp();
  expected /= expected.sum();
  // Single-precision features at most; the probabilities differ by far more.
  EXPECT_NEAR((posterior.probability - expected).cwiseAbs().maxCoeff(), 0.0, 1e-4);
  EXPECT_GT(expected.maxCoeff() - expected.minCoeff(), 0.1);
}

TEST_F(SurveyCorrelation, EveryStartIsFromTheSurvey) {
  GpLocalizeParams p = params();
  p.candidates.survey_correlation = {0.5, 1.0};
  p.particles = 2;
  GpLocalize filter(p, 1);
  const Eigen::Vector2d query(0.3, 1.1);
  const auto first = filter.predict_field(query);
  SE2 pose;
  for (int t = 0; t < kSteps; ++t) {
    pose = pose * exact_motion(t);
    filter.predict({seconds(t), seconds(t + 1), exact_motion(t)});
    filter.update({seconds(t + 1), {}, {{0, now(pose.translation()), 0.0}}});
  }
  EXPECT_GT((filter.predict_field(query).mean - first.mean).norm(), 1e-3);
  filter.reset();
  EXPECT_NEAR((filter.predict_field(query).mean - first.mean).norm(), 0.0, 1e-9);
}

// At the most probable pose, and whatever was learned on the way.
TEST_F(SurveyCorrelation, SaysWhatItLeavesUnknown) {
  const Eigen::Vector2d place(1.7, 2.2);
  for (const double rho : {0.0, 0.6, 1.0}) {
    GpLocalizeParams p = params();
    p.survey_correlation = rho;
    p.particles = 2;
    const auto models = make_field_models(p);
    const FieldSurvey all = read_survey(p.survey, {"light"}).at("light");
    const auto known = test::block_regression(dense_field(models[0], p), all.places, all.values,
                                              std::vector<int>(kRows, 0), place, -1);
    ParticleMap map(p, models);
    field_core::Random random(1);
    ParticleSet particles(2);
    particles[0].weight = 0.4;
    particles[1].weight = 0.6;
    particles[1].pose = SE2(place.x(), place.y(), 0.0);
    const std::vector<Observation> seen{{0, 0.5, models[0].noise_variance, 0.04, {}}};
    const double prior = models[0].signal_variance();
    for (int i = 0; i < 2 * kSlice; ++i) {
      std::vector<double> log_likelihood;
      Innovation innovation;
      map.weigh(particles, {}, seen, log_likelihood, innovation);
      EXPECT_NEAR(map.unknown(particles, seen), 1.0 - rho * rho * (1.0 - known.variance / prior),
                  1e-6);
      map.learn(particles, {}, seen, random);
    }
  }
}

}  // namespace
