// The packed product over particles x paths against the plain evaluation of every pair.
#include <gtest/gtest.h>

#include <cmath>

#include "../src/path_panels.hpp"
#include "field_core/random.hpp"
#include "gp_localize/online_sparse_gp.hpp"

using namespace gp_localize;
using field_core::KernelType;

namespace {

struct Setting {
  KernelType kernel;
  Recent recent;
  Precision precision;
  double tolerance;
};

class PathPanelsTest : public ::testing::TestWithParam<Setting> {};

constexpr double kNoise = 0.04, kLikelihoodNoise = 0.16;

// 23 paths and 31 particles: neither fills its last vector.
constexpr int kPaths = 23, kParticles = 31, kSlice = 5;

Eigen::Matrix2Xd places(field_core::Random& random, int count, double time) {
  Eigen::Matrix2Xd p(2, count);
  for (int i = 0; i < count; ++i) {
    p.col(i) << 5 + 4 * std::sin(0.3 * time) + 0.5 * random.normal(),
        5 + 4 * std::sin(0.2 * time) + 0.5 * random.normal();
  }
  return p;
}

TEST_P(PathPanelsTest, EqualsThePlainEvaluationOfEveryPair) {
  const Setting setting = GetParam();
  Eigen::Matrix2Xd support(2, 25);
  for (int i = 0; i < 25; ++i) support.col(i) << 2.5 * (i % 5), 2.5 * (i / 5);
  const SupportBasis basis({setting.kernel, 1.5, {2.0, 3.0}}, support, 1e-8, 0.0);
  std::vector<OnlineSparseGp> maps(kPaths, OnlineSparseGp(25, kSlice, setting.recent));
  const auto panels = make_path_panels(basis, kPaths, kSlice, setting.recent, setting.precision);
  Eigen::MatrixXd summaries(OnlineSparseGp::summary_size(25), kPaths);
  const auto close = [&] {
    for (int c = 0; c < kPaths; ++c) {
      summaries.col(c) = Eigen::Map<const Eigen::VectorXd>(maps[c].summary(), summaries.rows());
    }
    panels->assimilate(summaries);
  };
  close();
  field_core::Random random(3);
  OnlineSparseGp::Evaluation at;
  for (int t = 0; t < 18; ++t) {  // three full slices and an open one
    const double value = std::sin(0.5 * t) + 0.2 * random.normal();
    const Eigen::Matrix2Xd x = places(random, kParticles, t);
    Features phi;
    basis.features(x, phi);
    std::vector<double> fast;
    Eigen::Matrix2Xd moments;
    panels->begin(kParticles);
    panels->add(basis, x, value, kLikelihoodNoise, panels.get(), moments);
    panels->log_mean(fast);
    for (int p = 0; p < kParticles; ++p) {
      double density = 0.0, mean = 0.0, square = 0.0;
      for (int c = 0; c < kPaths; ++c) {
        maps[c].evaluate(basis, x.col(p), phi.data() + p, kParticles, at);
        const double v = at.variance + kLikelihoodNoise;
        density +=
            std::exp(-0.5 * (value - at.mean) * (value - at.mean) / v) / std::sqrt(v) / kPaths;
        mean += at.mean / kPaths;
        square += (v + at.mean * at.mean) / kPaths;
      }
      ASSERT_NEAR(fast[p], std::log(density), setting.tolerance) << "step " << t;
      ASSERT_NEAR(moments(0, p), mean, setting.tolerance) << "step " << t;
      ASSERT_NEAR(moments(1, p), square, setting.tolerance) << "step " << t;
    }
    const Eigen::Matrix2Xd own = places(random, kPaths, t);
    basis.features(own, phi);
    panels->extend(basis, own, phi, value, kNoise);
    for (int c = 0; c < kPaths; ++c) {
      maps[c].evaluate(basis, own.col(c), phi.data() + c, kPaths, at);
      maps[c].append(own.col(c), phi.data() + c, kPaths, at, value, kNoise);
    }
    if (t % kSlice == kSlice - 1) close();
  }
}

// Double: rounding, amplified by the condition of the support covariance (about 1e3 here). Single:
// 1e-7 of variances near 2 over noise variances of 0.04 and 0.16, and sums of 25^2 terms.
INSTANTIATE_TEST_SUITE_P(
    All, PathPanelsTest,
    ::testing::Values(
        Setting{KernelType::squared_exponential, Recent::used, Precision::double_precision, 1e-10},
        Setting{KernelType::matern32, Recent::used, Precision::double_precision, 1e-10},
        Setting{KernelType::matern52, Recent::used, Precision::double_precision, 1e-10},
        Setting{KernelType::squared_exponential, Recent::ignored, Precision::double_precision,
                1e-10},
        Setting{KernelType::squared_exponential, Recent::used, Precision::single_precision, 1e-4},
        Setting{KernelType::matern32, Recent::used, Precision::single_precision, 1e-4},
        Setting{KernelType::squared_exponential, Recent::ignored, Precision::single_precision,
                1e-4}));

/// Log likelihoods of a cloud of particles after two slices and a half, with and without sharing.
std::vector<double> weigh(KernelType kernel, Precision precision, double spread, double tolerance) {
  constexpr int kMany = 300;
  Eigen::Matrix2Xd support(2, 36);
  for (int i = 0; i < 36; ++i) support.col(i) << 2.0 * (i % 6), 2.0 * (i / 6);
  const SupportBasis basis({kernel, 1.5, {2.0, 3.0}}, support, 1e-8, 0.0);
  std::vector<OnlineSparseGp> maps(kPaths, OnlineSparseGp(36, kSlice, Recent::used));
  const auto panels = make_path_panels(basis, kPaths, kSlice, Recent::used, precision, tolerance);
  Eigen::MatrixXd summaries(OnlineSparseGp::summary_size(36), kPaths);
  field_core::Random random(4);
  OnlineSparseGp::Evaluation at;
  Features phi;
  for (int t = 0; t < 13; ++t) {
    if (t % kSlice == 0) {
      for (int c = 0; c < kPaths; ++c) {
        summaries.col(c) = Eigen::Map<const Eigen::VectorXd>(maps[c].summary(), summaries.rows());
      }
      panels->assimilate(summaries);
    }
    const double value = std::sin(0.5 * t) + 0.2 * random.normal();
    const Eigen::Matrix2Xd own = places(random, kPaths, t);
    basis.features(own, phi);
    panels->extend(basis, own, phi, value, kNoise);
    for (int c = 0; c < kPaths; ++c) {
      maps[c].evaluate(basis, own.col(c), phi.data() + c, kPaths, at);
      maps[c].append(own.col(c), phi.data() + c, kPaths, at, value, kNoise);
    }
  }
  Eigen::Matrix2Xd cloud(2, kMany), moments;
  for (int p = 0; p < kMany; ++p) {
    cloud.col(p) << 6.0 + spread * random.normal(), 5.0 + spread * random.normal();
  }
  std::vector<double> log_likelihood;
  panels->begin(kMany);
  panels->add(basis, cloud, 0.7, kLikelihoodNoise, panels.get(), moments);
  panels->log_mean(log_likelihood);
  return log_likelihood;
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

TEST(PathPanels, SharedEvaluationsStayWithinTheirTolerance) {
  for (const Precision precision : {Precision::single_precision, Precision::double_precision}) {
    const auto plain = weigh(KernelType::squared_exponential, precision, 0.3, 0.0);
    double before = 1.0;
    for (const double tolerance : {1e-2, 1e-4}) {
      const auto shared = weigh(KernelType::squared_exponential, precision, 0.3, tolerance);
      const double difference = largest_difference(plain, shared);
      // Residuals here are below three standard deviations: a density moves by at most
      // tolerance (3 + 9 / 2 + 1 / 2).
      EXPECT_LT(difference, 8.0 * tolerance);
      EXPECT_GT(difference, 0.0) << "evaluations were not shared";
      if (precision == Precision::double_precision) {
        EXPECT_LT(difference, 0.1 * before);
      }
      before = difference;
    }
  }
}

TEST(PathPanels, EvaluatesEveryPairWhereSharingCannotPay) {
  const auto exactly = [](KernelType kernel, double spread) {
    return largest_difference(weigh(kernel, Precision::double_precision, spread, 0.0),
                              weigh(kernel, Precision::double_precision, spread, 1e-2));
  };
  EXPECT_EQ(exactly(KernelType::squared_exponential, 4.0), 0.0);  // spread over the whole map
  EXPECT_EQ(exactly(KernelType::matern32, 0.3), 0.0);             // not smooth
  EXPECT_EQ(exactly(KernelType::matern52, 0.3), 0.0);
}

}  // namespace
