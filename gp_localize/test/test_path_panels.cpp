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
    panels->add(basis, x, phi, value, kLikelihoodNoise, panels.get(), moments);
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

}  // namespace
