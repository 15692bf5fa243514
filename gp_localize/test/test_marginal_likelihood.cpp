#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "dense_reference.hpp"
#include "field_core/errors.hpp"
#include "field_core/random.hpp"
#include "gp_localize/marginal_likelihood.hpp"

using namespace gp_localize;
using Eigen::MatrixXd;
using field_core::Kernel;
using field_core::KernelType;

namespace {

FieldSurvey survey(int n) {
  field_core::Random random(11);
  FieldSurvey s;
  s.places.resize(2, n);
  s.values.resize(n);
  for (int i = 0; i < n; ++i) {
    s.places.col(i) << random.uniform(0.0, 10.0), random.uniform(0.0, 6.0);
    s.values[i] = 4.0 + 2.0 * std::sin(0.8 * s.places(0, i)) * std::cos(s.places(1, i)) +
                  0.3 * random.normal();
  }
  s.places.col(n - 1) = s.places.col(0);  // a place measured twice
  return s;
}

Eigen::Matrix2Xd support() {
  Eigen::Matrix2Xd s(2, 12);
  for (int i = 0; i < 12; ++i) s.col(i) << 1.5 + 2.5 * (i % 4), 1.0 + 2.0 * (i / 4);
  return s;
}

const Hyperparameters kAt{3.5, 1.7, 0.4, Eigen::Vector2d(1.9, 2.6)};
constexpr double kJitter = 1e-6;

/// log N(z; mean, sigma) by an eigendecomposition, not by Cholesky.
double log_normal(const Eigen::VectorXd& z, double mean, const MatrixXd& sigma) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(sigma);
  const Eigen::VectorXd e = eigen.eigenvectors().transpose() * (z.array() - mean).matrix();
  const auto& d = eigen.eigenvalues();
  return -0.5 * ((e.array().square() / d.array()).sum() + d.array().log().sum() +
                 z.size() * std::log(2 * M_PI));
}

MatrixXd pitc_covariance(const Kernel& k, const FieldSurvey& s, int slice) {
  const auto noise_free = [&k](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return k(a, b);
  };
  const Eigen::Matrix2Xd u = support();
  MatrixXd kuu = test::gram(noise_free, u, u);
  kuu.diagonal().array() += kJitter * k.signal_variance();
  const MatrixXd kuf = test::gram(noise_free, u, s.places);
  MatrixXd sigma = kuf.transpose() * kuu.inverse() * kuf;
  for (int i = 0; i < s.values.size(); ++i) {
    for (int j = 0; j < s.values.size(); ++j) {
      if (i / slice == j / slice) sigma(i, j) = k(s.places.col(i), s.places.col(j));
    }
    sigma(i, i) += kAt.noise_stddev * kAt.noise_stddev;
  }
  return sigma;
}

class EveryKernel : public ::testing::TestWithParam<KernelType> {
 protected:
  Kernel kernel() const { return Kernel(GetParam(), kAt.signal_stddev, kAt.length_scales); }
};
INSTANTIATE_TEST_SUITE_P(Kernels, EveryKernel,
                         ::testing::Values(KernelType::squared_exponential, KernelType::matern32,
                                           KernelType::matern52));

TEST_P(EveryKernel, FullLikelihoodIsTheNormalDensity) {
  const FieldSurvey s = survey(30);
  MatrixXd sigma = kernel().matrix(s.places, s.places);
  sigma.diagonal().array() += kAt.noise_stddev * kAt.noise_stddev;
  EXPECT_NEAR(FullLikelihood(GetParam(), s)(to_theta(kAt), nullptr),
              log_normal(s.values, kAt.mean, sigma), 1e-9);
}

TEST_P(EveryKernel, PitcLikelihoodIsTheNormalDensityOfItsCovariance) {
  const FieldSurvey s = survey(33);  // the last slice is shorter
  EXPECT_NEAR(PitcLikelihood(GetParam(), s, support(), 7, kJitter)(to_theta(kAt), nullptr),
              log_normal(s.values, kAt.mean, pitc_covariance(kernel(), s, 7)), 1e-7);
}

TEST_P(EveryKernel, OneSliceIsExact) {
  const FieldSurvey s = survey(25);
  EXPECT_NEAR(PitcLikelihood(GetParam(), s, support(), 25)(to_theta(kAt), nullptr),
              FullLikelihood(GetParam(), s)(to_theta(kAt), nullptr), 1e-8);
}

TEST_P(EveryKernel, GradientsAgreeWithDifferences) {
  const FieldSurvey s = survey(33);
  const FullLikelihood full(GetParam(), s);
  const PitcLikelihood pitc(GetParam(), s, support(), 7);
  for (const MarginalLikelihood* likelihood : {static_cast<const MarginalLikelihood*>(&full),
                                               static_cast<const MarginalLikelihood*>(&pitc)}) {
    Theta gradient;
    (*likelihood)(to_theta(kAt), &gradient);
    for (int i = 0; i < gradient.size(); ++i) {
      constexpr double kStep = 1e-5;
      Theta above = to_theta(kAt), below = above;
      above[i] += kStep;
      below[i] -= kStep;
      const double difference =
          ((*likelihood)(above, nullptr) - (*likelihood)(below, nullptr)) / (2.0 * kStep);
      // Rounding of values near 50 by the step: 1e-9; the jitter's conditioning costs two digits.
      EXPECT_NEAR(gradient[i], difference, 1e-5 * (1.0 + std::abs(difference))) << "theta " << i;
    }
  }
}

TEST(MarginalLikelihood, LongerSlicesAndMoreSupportComeNearerToExact) {
  const FieldSurvey s = survey(60);
  const double exact = FullLikelihood(KernelType::squared_exponential, s)(to_theta(kAt), nullptr);
  const auto gap = [&](const Eigen::Matrix2Xd& u, int slice) {
    const PitcLikelihood pitc(KernelType::squared_exponential, s, u, slice);
    return std::abs(pitc(to_theta(kAt), nullptr) - exact);
  };
  EXPECT_GT(gap(support().leftCols(3), 1), gap(support(), 1));
  EXPECT_GT(gap(support().leftCols(3), 1), gap(support().leftCols(3), 30));
}

TEST(MarginalLikelihood, ThetaAndHyperparametersAreTheSame) {
  const Hyperparameters back = from_theta(to_theta(kAt));
  EXPECT_NEAR(back.mean, 3.5, 1e-15);
  EXPECT_NEAR(back.signal_stddev, 1.7, 1e-15);
  EXPECT_NEAR(back.noise_stddev, 0.4, 1e-15);
  EXPECT_NEAR(back.length_scales.y(), 2.6, 1e-15);
}

TEST(MarginalLikelihood, ASingularCovarianceIsSaid) {
  const FieldSurvey s = survey(30);
  Hyperparameters flat = kAt;
  flat.noise_stddev = 1e-200;
  try {
    FullLikelihood(KernelType::squared_exponential, s)(to_theta(flat), nullptr);
    FAIL() << "a singular covariance was factorized";
  } catch (const field_core::NumericalError& e) {
    EXPECT_NE(std::string(e.what()).find("singular"), std::string::npos);
  }
}

}  // namespace
