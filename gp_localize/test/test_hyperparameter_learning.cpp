#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "field_core/errors.hpp"
#include "field_core/random.hpp"
#include "gp_localize/hyperparameter_learning.hpp"

using namespace gp_localize;
using field_core::KernelType;

namespace {

const Hyperparameters kTruth{20.0, 2.0, 0.3, Eigen::Vector2d(1.5, 3.0)};

/// A draw of the Gaussian process itself.
FieldSurvey draw(int n, std::uint64_t seed) {
  field_core::Random random(seed);
  FieldSurvey s;
  s.places.resize(2, n);
  Eigen::VectorXd white(n);
  for (int i = 0; i < n; ++i) {
    s.places.col(i) << random.uniform(0.0, 12.0), random.uniform(0.0, 12.0);
    white[i] = random.normal();
  }
  const field_core::Kernel kernel(KernelType::squared_exponential, kTruth.signal_stddev,
                                  kTruth.length_scales);
  Eigen::MatrixXd sigma = kernel.matrix(s.places, s.places);
  sigma.diagonal().array() += kTruth.noise_stddev * kTruth.noise_stddev;
  s.values = (sigma.llt().matrixL() * white).array() + kTruth.mean;
  return s;
}

/// Over several worlds: errors in units of the standard errors that were reported.
TEST(HyperparameterLearning, FindsWhatTheWorldWasDrawnFrom) {
  LearningOptions options;
  options.starts = 3;
  double squares = 0.0;
  constexpr int kWorlds = 8;
  for (int seed = 1; seed <= kWorlds; ++seed) {
    const LearnedField learned = learn_hyperparameters(draw(150, seed), options);
    EXPECT_TRUE(learned.exact);
    const Theta error = to_theta(learned.value) - to_theta(kTruth);
    const Theta stddev =
        (Theta(5) << learned.standard_error.mean,
         learned.standard_error.signal_stddev / learned.value.signal_stddev,
         learned.standard_error.noise_stddev / learned.value.noise_stddev,
         learned.standard_error.length_scales.cwiseQuotient(learned.value.length_scales))
            .finished();
    for (int i = 0; i < 5; ++i) {
      ASSERT_GT(stddev[i], 0.0) << "theta " << i;
      EXPECT_LT(std::abs(error[i]), 5.0 * stddev[i]) << "theta " << i << ", world " << seed;
    }
    squares += error.cwiseQuotient(stddev).squaredNorm() / 5.0;
  }
  // Mean of 40 squares near chi-squared with one degree each: 1 +- 0.22; correlated within a world,
  // and 150 measurements are not asymptotic, hence a factor of 2 either way.
  EXPECT_GT(squares / kWorlds, 0.4);
  EXPECT_LT(squares / kWorlds, 2.2);
}

TEST(HyperparameterLearning, IsAMaximum) {
  const FieldSurvey s = draw(80, 3);
  const LearnedField learned = learn_hyperparameters(s, {});
  const FullLikelihood likelihood(KernelType::squared_exponential, s);
  Theta gradient;
  EXPECT_NEAR(likelihood(to_theta(learned.value), &gradient), learned.log_likelihood, 1e-9);
  EXPECT_LT(gradient.norm(), 0.02);
  for (int i = 0; i < 5; ++i) {
    for (const double step : {-0.05, 0.05}) {
      Theta beside = to_theta(learned.value);
      beside[i] += step;
      EXPECT_LT(likelihood(beside, nullptr), learned.log_likelihood);
    }
  }
  EXPECT_GT(learned.log_likelihood, likelihood(to_theta(kTruth), nullptr));
  EXPECT_GE(learned.agreeing, 1);
}

TEST(HyperparameterLearning, PitcFindsNearlyTheSame) {
  const FieldSurvey s = draw(200, 5);
  LearningOptions options;
  options.starts = 2;
  const LearnedField exact = learn_hyperparameters(s, options);
  options.exact_up_to = 0;
  const LearnedField sparse = learn_hyperparameters(s, options);
  EXPECT_FALSE(sparse.exact);
  const Theta difference = to_theta(sparse.value) - to_theta(exact.value);
  // 100 support points for 200 measurements: well within the standard errors (0.1 to 0.2).
  EXPECT_LT(difference.tail<4>().cwiseAbs().maxCoeff(), 0.1);
  EXPECT_NE(sparse.value.length_scales.x(), exact.value.length_scales.x());
}

TEST(HyperparameterLearning, SaysWhatIsNotDetermined) {
  FieldSurvey line = draw(60, 2);
  line.places.row(1).setConstant(4.0);  // nothing is known of the field across the line
  const LearnedField learned = learn_hyperparameters(line, {});
  EXPECT_TRUE(std::isnan(learned.standard_error.length_scales.y()) ||
              learned.standard_error.length_scales.y() > learned.value.length_scales.y());
  LearnedField unknown = learned;
  unknown.standard_error.length_scales.y() = NAN;
  EXPECT_NE(to_yaml("f", "lx", unknown).find("not determined"), std::string::npos);
}

TEST(HyperparameterLearning, RefusesWhatCannotBeLearned) {
  EXPECT_THROW(learn_hyperparameters(draw(9, 1), {}), field_core::DataError);
  FieldSurvey constant = draw(20, 1);
  constant.values.setConstant(3.0);
  EXPECT_THROW(learn_hyperparameters(constant, {}), field_core::DataError);
  FieldSurvey spot = draw(20, 1);
  spot.places.colwise() = Eigen::Vector2d(1.0, 2.0);
  EXPECT_THROW(learn_hyperparameters(spot, {}), field_core::DataError);
}

TEST(HyperparameterLearning, SameSeedSameNumbers) {
  const FieldSurvey s = draw(40, 4);
  EXPECT_EQ(to_theta(learn_hyperparameters(s, {}).value),
            to_theta(learn_hyperparameters(s, {}).value));
}

}  // namespace
