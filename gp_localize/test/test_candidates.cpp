// Hyperparameters learned during the run: with an exact path the particles' weights are the PITC
// marginal likelihood of the whole run, as the batch computes it (test_marginal_likelihood holds
// that against dense matrices).
#include <gtest/gtest.h>

#include <cmath>

#include "exact_drive.hpp"
#include "field_core/errors.hpp"
#include "gp_localize/marginal_likelihood.hpp"

using namespace gp_localize;
using field_core::SE2;
using std::chrono::seconds;

namespace {

/// One particle per combination of candidates.
GpLocalizeParams params() {
  GpLocalizeParams p = exact_params();
  p.candidates.length_scales = {0.6, 1.0, 1.6};
  p.candidates.noise = {0.5, 1.0};
  p.candidates.signal = {1.0, 2.0};
  p.particles = static_cast<int>(p.candidates.count());
  return p;
}

double light_at(const SE2& pose) {
  return 3.0 + 1.3 * std::sin(1.1 * pose.x()) * std::cos(0.7 * pose.y());
}

/// Drives; what was measured, where.
FieldSurvey drive(GpLocalize& filter, int from, int to) {
  FieldSurvey survey;
  survey.places.resize(2, to - from);
  survey.values.resize(to - from);
  SE2 pose;
  for (int t = 0; t < to; ++t) {
    const SE2 delta = exact_motion(t);
    pose = pose * delta;
    if (t < from) continue;
    const double value = light_at(pose) + 0.1 * std::sin(17.0 * t);
    filter.predict({seconds(t), seconds(t + 1), delta});
    EXPECT_TRUE(filter.update({seconds(t + 1), {}, {{0, value, 0.0}}}).applied);
    survey.places.col(t - from) = pose.translation();
    survey.values[t - from] = value;
  }
  return survey;
}

/// What the batch says of the same combinations.
Eigen::VectorXd batch_posterior(const GpLocalizeParams& p, const Eigen::MatrixXd& values,
                                const FieldSurvey& survey) {
  const PitcLikelihood likelihood(field_core::KernelType::squared_exponential, survey,
                                  make_field_models(p)[0].basis.support(), kSlice,
                                  p.support.jitter);
  Eigen::VectorXd log_evidence(values.cols());
  for (Eigen::Index c = 0; c < values.cols(); ++c) {
    const Hyperparameters h{3.0, values(3, c), values(2, c),
                            Eigen::Vector2d(values(0, c), values(1, c))};
    log_evidence[c] = likelihood(to_theta(h), nullptr);
  }
  const Eigen::VectorXd weights = (log_evidence.array() - log_evidence.maxCoeff()).exp();
  return weights / weights.sum();
}

TEST(Candidates, PosteriorIsThePitcMarginalLikelihood) {
  const GpLocalizeParams p = params();
  for (const int steps : {2 * kSlice, 5 * kSlice + 2}) {  // at the end of a slice, and within one
    GpLocalize filter(p, 1);
    const FieldSurvey survey = drive(filter, 0, steps);
    const auto posterior = filter.hyperparameters().at(0);
    ASSERT_EQ(posterior.values.cols(), 12);
    EXPECT_NEAR(posterior.probability.sum(), 1.0, 1e-12);
    const Eigen::VectorXd expected = batch_posterior(p, posterior.values, survey);
    EXPECT_LT(expected.maxCoeff(), 0.99);  // or little would be compared
    for (Eigen::Index c = 0; c < 12; ++c) {
      // Log evidences of up to 100 over supports with condition 1e6.
      EXPECT_NEAR(posterior.probability[c], expected[c], 1e-7) << "candidate " << c;
    }
  }
}

TEST(Candidates, ExponentTempersThePosterior) {
  GpLocalizeParams p = params();
  GpLocalize plain(p, 1);
  p.likelihood_exponent = 0.3;
  GpLocalize tempered(p, 1);
  drive(plain, 0, 20);
  drive(tempered, 0, 20);
  const Eigen::ArrayXd expected = plain.hyperparameters()[0].probability.array().pow(0.3);
  for (Eigen::Index c = 0; c < 12; ++c) {
    EXPECT_NEAR(tempered.hyperparameters()[0].probability[c], expected[c] / expected.sum(), 1e-9);
  }
}

TEST(Candidates, ListsEveryCombinationWithItsValues) {
  GpLocalize filter(params(), 1);
  const auto posterior = filter.hyperparameters().at(0);
  EXPECT_EQ(posterior.field, "light");
  EXPECT_EQ(posterior.names.size(), 4u);
  EXPECT_NEAR((posterior.values.col(0) - Eigen::Vector4d(0.9, 1.2, 0.1, 1.0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((posterior.values.col(11) - Eigen::Vector4d(2.4, 3.2, 0.2, 2.0)).norm(), 0.0, 1e-12);
  for (Eigen::Index c = 0; c < 12; ++c) EXPECT_NEAR(posterior.probability[c], 1.0 / 12, 1e-12);
}

TEST(Candidates, PredictionIsTheirMixture) {
  GpLocalizeParams p = params();
  GpLocalize filter(p, 1);
  drive(filter, 0, 2 * kSlice + 3);
  const auto posterior = filter.hyperparameters().at(0);
  const Eigen::Vector2d query(0.7, 2.9);
  double mean = 0.0, square = 0.0, noise = 0.0;
  for (Eigen::Index c = 0; c < 12; ++c) {  // each alone, as a configured model
    GpLocalizeParams alone = p;
    alone.candidates = CandidateParams{};
    alone.particles = 1;
    FieldParams& f = alone.fields.at("light");
    f.length_scales = {posterior.values(0, c), posterior.values(1, c)};
    f.noise_stddev = posterior.values(2, c);
    f.signal_stddev = posterior.values(3, c);
    GpLocalize single(alone, 1);
    drive(single, 0, 2 * kSlice + 3);
    const auto prediction = single.predict_field(query);
    const double field_variance = prediction.variance(0, 0) - f.noise_stddev * f.noise_stddev;
    mean += posterior.probability[c] * prediction.mean(0, 0);
    noise += posterior.probability[c] * std::pow(f.noise_stddev, 2);
    square += posterior.probability[c] * (field_variance + std::pow(prediction.mean(0, 0), 2));
  }
  const auto mixture = filter.predict_field(query);
  EXPECT_NEAR(mixture.mean(0, 0), mean, 1e-8);
  EXPECT_NEAR(mixture.variance(0, 0), square - mean * mean + noise, 1e-8);
}

// Of two fields, each with 2 x 2 candidates: 16 pairs, or the 4 that are the same for both.
TEST(Candidates, MayBeSharedByAllFields) {
  GpLocalizeParams p = exact_params();
  p.fields["other"] = p.fields.at("light");
  p.candidates.length_scales = {0.6, 1.6};
  p.candidates.noise = {0.5, 1.0};
  p.particles = 64;
  for (const bool shared : {false, true}) {
    p.candidates.shared = shared;
    GpLocalize filter(p, 1);
    SE2 pose;
    for (int t = 0; t < 2 * kSlice; ++t) {
      pose = pose * exact_motion(t);
      filter.predict({seconds(t), seconds(t + 1), exact_motion(t)});
      // `other` alone is noisy: a shared candidate has to suit both.
      filter.update({seconds(t + 1), {}, {{0, light_at(pose), 0.0}, {1, 3.0 + t % 2, 0.0}}});
    }
    const auto all = filter.hyperparameters();
    const double apart = (all[0].probability - all[1].probability).cwiseAbs().maxCoeff();
    if (shared) {
      EXPECT_LT(apart, 1e-12);
    } else {
      EXPECT_GT(apart, 0.1);
    }
    EXPECT_NEAR(all[0].probability.sum(), 1.0, 1e-12);
  }
}

TEST(Candidates, AreSavedAndRestored) {
  const GpLocalizeParams p = resampling(params());
  GpLocalize first(p, 1), second(p, 2);
  drive(first, 0, 20);
  second.restore(first.state());
  drive(first, 20, 40);
  drive(second, 20, 40);
  EXPECT_EQ(first.belief().mean.vector(), second.belief().mean.vector());
  EXPECT_EQ(first.hyperparameters()[0].probability, second.hyperparameters()[0].probability);
  EXPECT_LT(first.hyperparameters()[0].probability.minCoeff(), 1.0 / 12);  // something was learned
}

TEST(Candidates, AreForMappingOnly) {
  GpLocalizeParams p = params();
  EXPECT_NO_THROW(p.validate());
  p.candidates.survey_correlation = {0.5, 1.0};  // of no survey
  EXPECT_THROW(p.validate(), field_core::ParameterError);
  p = params();
  p.mode = Mode::lifelong;
  EXPECT_THROW(p.validate(), field_core::ParameterError);
  p = params();
  p.map_hypotheses = MapHypotheses::sample_paths;
  EXPECT_THROW(p.validate(), field_core::ParameterError);
}

}  // namespace
