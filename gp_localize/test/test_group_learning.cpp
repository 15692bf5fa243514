// Hyperparameters of correlated fields: the likelihood against a normal density written out, its
// gradient, and learning in worlds that were drawn from the model.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "correlated_reference.hpp"
#include "field_core/errors.hpp"
#include "field_core/random.hpp"
#include "gp_localize/hyperparameter_learning.hpp"

using namespace gp_localize;
using field_core::KernelType;

namespace {

const std::vector<std::string> kNames = {"c", "a", "b"};

/// Three fields of N(mean, s), R by its partial correlations.
Theta truth() {
  Theta theta(14);
  theta << 5.0, -1.0, 100.0,                         //
      std::log(2.0), std::log(0.5), std::log(30.0),  //
      std::log(0.3), std::log(0.1), std::log(6.0),   //
      0.7, -0.4, 0.3,                                //
      std::log(1.5), std::log(2.5);
  return theta;
}

test::CorrelatedFields dense() {
  const double r_ca = 0.7, r_cb = -0.4;  // the first partials are correlations
  const double r_ab = r_ca * r_cb + 0.3 * std::sqrt((1 - r_ca * r_ca) * (1 - r_cb * r_cb));
  test::CorrelatedFields world;
  world.b.resize(3, 3);
  world.b << 1.0, r_ca, r_cb, r_ca, 1.0, r_ab, r_cb, r_ab, 1.0;
  const Eigen::Vector3d s(2.0, 0.5, 30.0);
  world.b = (s.asDiagonal() * world.b * s.asDiagonal()).eval();
  world.lengths << 1.5, 2.5;
  return world;
}

Eigen::MatrixXd covariance(const FieldSurvey& s) {
  const auto world = dense();
  const double noise[] = {0.3, 0.1, 6.0};
  Eigen::MatrixXd sigma(s.values.size(), s.values.size());
  for (Eigen::Index i = 0; i < sigma.rows(); ++i) {
    const int f = static_cast<int>(s.places(2, i));
    for (Eigen::Index j = 0; j < sigma.cols(); ++j) {
      sigma(i, j) = world.k(s.places.col(i).head<2>(), f, s.places.col(j).head<2>(),
                            static_cast<int>(s.places(2, j)));
    }
    sigma(i, i) += noise[f] * noise[f];
  }
  return sigma;
}

/// A draw of the model; the second field is missing at every fourth place.
Survey draw(int places, std::uint64_t seed) {
  field_core::Random random(seed);
  SurveyBuilder builder;
  for (int i = 0; i < places; ++i) {
    const Eigen::Vector2d at(random.uniform(0.0, 10.0), random.uniform(0.0, 10.0));
    for (int f = 0; f < 3; ++f) {
      if (f != 1 || i % 4 != 0) builder.add(kNames[f], at, 0.0);
    }
  }
  Survey survey = builder.build();
  const FieldSurvey all = merge(survey, kNames);
  Eigen::VectorXd white(all.values.size());
  for (double& value : white) value = random.normal();
  const Eigen::VectorXd values = covariance(all).llt().matrixL() * white;
  const double mean[] = {5.0, -1.0, 100.0};
  Eigen::Index next[3] = {0, 0, 0};
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const int f = static_cast<int>(all.places(2, i));
    survey.at(kNames[f]).values[next[f]++] = mean[f] + values[i];
  }
  return survey;
}

TEST(GroupLearning, ReadingsOfOnePlaceFollowEachOther) {
  const FieldSurvey all = merge(draw(9, 1), kNames);
  ASSERT_EQ(3 * 9 - 3, all.values.size());
  EXPECT_EQ(0.0, all.places(2, 0));  // place 0 without the second field, place 1 with it
  EXPECT_EQ(2.0, all.places(2, 1));
  EXPECT_EQ(1.0, all.places(2, 3));
  EXPECT_EQ(all.places.col(2).head<2>(), all.places.col(4).head<2>());
}

TEST(GroupLearning, LikelihoodsHaveTheRightValueAndGradient) {
  const FieldSurvey s = merge(draw(14, 2), kNames);
  const auto n = s.values.size();
  test::JointMoments moments{Eigen::VectorXd(n), covariance(s)};
  for (Eigen::Index i = 0; i < n; ++i) {
    moments.mean[i] = truth()[static_cast<int>(s.places(2, i))];
  }
  const double expected = test::log_density(moments, s.values, Eigen::VectorXd::Zero(n)) -
                          0.5 * n * std::log(2.0 * M_PI);
  const FullLikelihood full(KernelType::squared_exponential, s, 3);
  EXPECT_NEAR(expected, full(truth(), nullptr), 1e-8);
  const PitcLikelihood one_slice(KernelType::squared_exponential, s, s.places.leftCols(6), 60, 1e-6,
                                 3);
  EXPECT_NEAR(expected, one_slice(truth(), nullptr), 1e-6);
  const PitcLikelihood pitc(KernelType::squared_exponential, s, s.places.leftCols(11), 7, 1e-3, 3);
  for (const MarginalLikelihood* likelihood : {static_cast<const MarginalLikelihood*>(&full),
                                               static_cast<const MarginalLikelihood*>(&pitc)}) {
    Theta gradient;
    (*likelihood)(truth(), &gradient);
    ASSERT_EQ(14, gradient.size());
    for (Eigen::Index i = 0; i < gradient.size(); ++i) {
      constexpr double kStep = 1e-5;
      Theta above = truth(), below = truth();
      above[i] += kStep;
      below[i] -= kStep;
      const double slope =
          ((*likelihood)(above, nullptr) - (*likelihood)(below, nullptr)) / (2.0 * kStep);
      EXPECT_NEAR(gradient[i], slope, 1e-5 * (1.0 + std::abs(slope))) << "theta " << i;
    }
  }
}

/// Errors in units of the standard errors that were reported.
TEST(GroupLearning, FindsWhatTheWorldWasDrawnFrom) {
  LearningOptions options;
  options.starts = 1;
  const auto world = dense();
  double squares = 0.0;
  int count = 0;
  for (int seed = 1; seed <= 4; ++seed) {
    const LearnedGroup group = learn_group(draw(70, seed), kNames, options);
    const auto add = [&](double learned, double truth, double error) {
      ASSERT_GT(error, 0.0);
      EXPECT_LT(std::abs(learned - truth), 5.0 * error) << learned << " for " << truth;
      squares += std::pow((learned - truth) / error, 2);
      ++count;
    };
    const double mean[] = {5.0, -1.0, 100.0}, noise[] = {0.3, 0.1, 6.0};
    for (int f = 0; f < 3; ++f) {
      const auto& value = group.fields[f].value;
      const auto& error = group.fields[f].standard_error;
      add(value.mean, mean[f], error.mean);
      add(value.signal_stddev, std::sqrt(world.b(f, f)), error.signal_stddev);
      add(value.noise_stddev, noise[f], error.noise_stddev);
      for (int g = 0; g < f; ++g) {
        add(group.correlation(f, g), world.b(f, g) / std::sqrt(world.b(f, f) * world.b(g, g)),
            group.correlation_error(f, g));
        // 1 / sqrt(n) for the n = 27 areas of a length scale each: 0.2.
        EXPECT_LT(group.correlation_error(f, g), 0.3);
      }
    }
    add(group.fields[0].value.length_scales.x(), 1.5,
        group.fields[0].standard_error.length_scales.x());
    EXPECT_EQ(group.fields[0].value.length_scales, group.fields[2].value.length_scales);
  }
  // 52 squares near chi-squared with one degree each: 1 +- 0.2, correlated within a world; a factor
  // of 2 either way, as in test_hyperparameter_learning.
  EXPECT_GT(squares / count, 0.4);
  EXPECT_LT(squares / count, 2.2);
}

TEST(GroupLearning, WritesWhatTheFilterTakesAndRefusesWhatCannotBeLearned) {
  Survey survey = draw(30, 3);
  LearningOptions options;
  options.starts = 1;
  const LearnedGroup group = learn_group(survey, {"a", "c"}, options);
  const std::string yaml = to_yaml("room", group);
  EXPECT_NE(std::string::npos, yaml.find("  room:\n")) << yaml;
  EXPECT_NE(std::string::npos, yaml.find("    fields: [a, c]\n    correlations: [0.")) << yaml;
  EXPECT_NE(std::string::npos, yaml.find("]  # +- 0.")) << yaml;
  const auto message = [&](const std::vector<std::string>& names) -> std::string {
    try {
      learn_group(survey, names, options);
    } catch (const field_core::DataError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(std::string::npos, message({"a", "z"}).find("field 'z' was not measured"));
  survey.at("b").values.setConstant(1.0);
  EXPECT_NE(std::string::npos, message({"a", "b"}).find("field 'b' has the same value"));
}

}  // namespace
