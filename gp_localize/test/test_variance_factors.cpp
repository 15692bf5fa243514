// Unknown common factor of a field's signal and noise variance: the filter against integrals over
// the factor computed numerically with configured models.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "exact_drive.hpp"
#include "field_core/errors.hpp"

using namespace gp_localize;
using field_core::SE2;
using std::chrono::seconds;

namespace {

constexpr double kDof = 5.0;

/// One particle per length scale.
GpLocalizeParams params() {
  GpLocalizeParams p = exact_params();
  p.candidates.length_scales = {0.6, 1.0, 1.6};
  p.particles = 3;
  p.variance_dof = kDof;
  return p;
}

/// One particle with the configured length scale.
GpLocalizeParams one_particle() {
  GpLocalizeParams p = params();
  p.candidates = CandidateParams{};
  p.particles = 1;
  return p;
}

double light_at(const SE2& pose, double amplitude) {
  return 3.0 + amplitude * std::sin(1.1 * pose.x()) * std::cos(0.7 * pose.y());
}

struct Errors {
  double log_density = 0.0, nis = 0.0;  // sums over the steps
};

/// Drives and measures; log N(z; mean, variance) of the measurements before each update.
Errors drive(GpLocalize& filter, int from, int to, double amplitude = 0.6) {
  Errors sum;
  SE2 pose;
  for (int t = 0; t < to; ++t) {
    const SE2 delta = exact_motion(t);
    pose = pose * delta;
    if (t < from) continue;
    const double value = light_at(pose, amplitude) + 0.05 * std::sin(17.0 * t);
    const auto before = filter.predict_field(pose.translation());
    const double error = value - before.mean(0, 0);
    sum.log_density -= 0.5 * (std::log(2.0 * M_PI * before.variance(0, 0)) +
                              error * error / before.variance(0, 0));
    filter.predict({seconds(t), seconds(t + 1), delta});
    const auto result = filter.update({seconds(t + 1), {}, {{0, value, 0.0}}});
    EXPECT_TRUE(result.applied);
    sum.nis += result.nis;
  }
  return sum;
}

/// One configured model whose variances are multiplied by `factor`.
GpLocalizeParams scaled(double length_scale, double factor) {
  GpLocalizeParams p = one_particle();
  FieldParams& f = p.fields.at("light");
  f.signal_stddev *= std::sqrt(factor);
  f.noise_stddev *= std::sqrt(factor);
  for (double& l : f.length_scales) l *= length_scale;
  p.variance_dof = 0.0;
  return p;
}

/// Log density of an inverse gamma variable with shape and scale dof / 2.
double log_prior(double factor) {
  const double a = 0.5 * kDof;
  return a * std::log(a) - std::lgamma(a) - (a + 1.0) * std::log(factor) - a / factor;
}

struct Integrals {
  double evidence = 0.0, inverse_factor = 0.0;  // 1 and 1 / factor, over the posterior
};

/// Over the factor, by the trapezoidal rule in its logarithm: exponentially exact here.
Integrals integrate(double length_scale, int steps, double exponent) {
  constexpr double kStep = 0.1;
  Integrals sum;
  for (double u = -5.0; u <= 3.0; u += kStep) {
    const double factor = std::exp(u);
    GpLocalize single(scaled(length_scale, factor), 1);
    const double log_weight =
        exponent * drive(single, 0, steps).log_density + log_prior(factor) + u;
    sum.evidence += kStep * std::exp(log_weight);
    sum.inverse_factor += kStep * std::exp(log_weight) / factor;
  }
  return sum;
}

TEST(VarianceFactors, AreIntegratedOut) {
  for (const double exponent : {1.0, 0.4}) {
    constexpr int kSteps = 2 * kSlice + 3;  // within a slice
    GpLocalizeParams p = params();
    p.likelihood_exponent = exponent;
    GpLocalize filter(p, 1);
    drive(filter, 0, kSteps);
    const auto posterior = filter.hyperparameters().at(0);
    ASSERT_EQ(posterior.probability.size(), 3);
    EXPECT_LT(posterior.probability.maxCoeff(), 0.99);  // or little would be compared
    Eigen::Vector3d evidence;
    for (int c = 0; c < 3; ++c) {
      const Integrals sum = integrate(p.candidates.length_scales[c], kSteps, exponent);
      evidence[c] = sum.evidence;
      // The published standard deviations are those under 1 / E[1 / factor].
      const double factor = sum.evidence / sum.inverse_factor;
      EXPECT_NEAR(posterior.values(3, c), std::sqrt(factor), 1e-6) << c;
      EXPECT_NEAR(posterior.values(2, c), 0.2 * std::sqrt(factor), 1e-6) << c;
    }
    evidence /= evidence.sum();
    // Supports with condition 1e6, and the rule's own error.
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(posterior.probability[c], evidence[c], 1e-6) << c;
  }
}

TEST(VarianceFactors, ScaleThePredictedVariance) {
  GpLocalize learned(one_particle(), 1);
  drive(learned, 0, 2 * kSlice + 3);
  const double factor = std::pow(learned.hyperparameters().at(0).values(3, 0), 2);
  EXPECT_LT(factor, 0.7);  // the field varies less than configured
  GpLocalize configured(scaled(1.0, factor), 1);
  drive(configured, 0, 2 * kSlice + 3);
  for (const Eigen::Vector2d& point : {Eigen::Vector2d(0.7, 2.9), Eigen::Vector2d(9.0, 9.0)}) {
    const auto a = learned.predict_field(point), b = configured.predict_field(point);
    EXPECT_NEAR(a.mean(0, 0), b.mean(0, 0), 1e-9);
    EXPECT_NEAR(a.variance(0, 0), b.variance(0, 0), 1e-9);
    EXPECT_NEAR(a.prior_variance[0], b.prior_variance[0], 1e-9);
  }
}

TEST(VarianceFactors, MakeTheNisHonest) {
  // Errors are a fifth of what the configuration says.
  GpLocalizeParams p = one_particle();
  GpLocalize learned(p, 1);
  p.variance_dof = 0.0;
  GpLocalize fixed(p, 1);
  drive(learned, 0, 60, 0.2);
  drive(fixed, 0, 60, 0.2);
  const double with = drive(learned, 60, 100, 0.2).nis / 40.0;
  const double without = drive(fixed, 60, 100, 0.2).nis / 40.0;
  EXPECT_LT(without, 0.2);
  EXPECT_GT(with, 3.0 * without);
  EXPECT_LT(with, 1.5);
}

TEST(VarianceFactors, AreSavedAndRestored) {
  const GpLocalizeParams p = resampling(params());
  GpLocalize first(p, 1), second(p, 2);
  drive(first, 0, 20);
  second.restore(first.state());
  EXPECT_EQ(first.hyperparameters()[0].values, second.hyperparameters()[0].values);
  drive(first, 20, 40);
  drive(second, 20, 40);
  EXPECT_EQ(first.belief().mean.vector(), second.belief().mean.vector());
  EXPECT_EQ(first.hyperparameters()[0].values, second.hyperparameters()[0].values);
}

TEST(VarianceFactors, RefusesWhatItCannotBeUsedWith) {
  EXPECT_NO_THROW(params().validate());
  GpLocalizeParams p = params();
  p.outlier_share = 0.1;
  EXPECT_THROW(p.validate(), field_core::ParameterError);
  p = params();
  p.map_hypotheses = MapHypotheses::sample_paths;
  p.candidates = CandidateParams{};
  EXPECT_THROW(p.validate(), field_core::ParameterError);
}

}  // namespace
