// Interpolation over a box against the functions themselves: Gaussian process posteriors, for which
// the bound is derived.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "../src/interpolation_box.hpp"
#include "field_core/kernels.hpp"
#include "field_core/random.hpp"

using namespace gp_localize;

namespace {

constexpr int kPlaces = 60, kMeasurements = 40, kMost = 2500;
constexpr double kSigma = 1.5, kNoise = 0.3;
const Eigen::Vector2d kLengths{2.0, 3.0};

Eigen::Matrix2Xd uniform(field_core::Random& random, int count, const Eigen::Vector2d& half) {
  Eigen::Matrix2Xd p(2, count);
  for (int i = 0; i < count; ++i) {
    p.col(i) << 1.0 + half.x() * (2.0 * random.uniform() - 1.0),
        -2.0 + half.y() * (2.0 * random.uniform() - 1.0);
  }
  return p;
}

/// Posterior of a field with random measurements in and around the box.
struct Posterior {
  explicit Posterior(field_core::Random& random)
      : kernel(field_core::KernelType::squared_exponential, kSigma, kLengths),
        at(uniform(random, kMeasurements, {6.0, 6.0})) {
    Eigen::MatrixXd k = kernel.matrix(at, at);
    k.diagonal().array() += kNoise * kNoise;
    factor.compute(k);
    Eigen::VectorXd draw(kMeasurements);
    for (double& d : draw) d = random.normal();
    const Eigen::VectorXd z = factor.matrixL() * draw;
    weights = factor.solve(z);
    norm = std::sqrt(weights.dot(kernel.matrix(at, at) * weights));
  }
  Eigen::VectorXd mean(const Eigen::Matrix2Xd& x) const { return kernel.matrix(x, at) * weights; }
  Eigen::VectorXd variance(const Eigen::Matrix2Xd& x) const {
    const Eigen::MatrixXd k = kernel.matrix(at, x);
    return kSigma * kSigma - k.cwiseProduct(factor.solve(k)).colwise().sum().transpose().array();
  }
  field_core::Kernel kernel;
  Eigen::Matrix2Xd at;
  Eigen::LLT<Eigen::MatrixXd> factor;
  Eigen::VectorXd weights;
  double norm = 0.0;
};

class InterpolationBoxTest : public ::testing::TestWithParam<double> {};

TEST_P(InterpolationBoxTest, StaysBelowItsBoundWithoutWastingNodes) {
  const double tolerance = GetParam();
  field_core::Random random(11);
  InterpolationBox box;
  for (const double width : {1e-9, 0.05, 0.3, 1.0, 2.0}) {  // half widths, in length scales
    const Eigen::Matrix2Xd places = uniform(random, kPlaces, width * kLengths);
    const Posterior posterior(random);
    ASSERT_TRUE(box.fit(places, kLengths, {tolerance, tolerance}, kMost));
    const Eigen::Matrix2Xd nodes = box.nodes();
    const Eigen::Map<const Eigen::MatrixXd> coefficients(box.coefficients().data(), kPlaces,
                                                         nodes.cols());
    const double mean_error =
        (coefficients * posterior.mean(nodes) - posterior.mean(places)).cwiseAbs().maxCoeff();
    const double variance_error =
        (coefficients * posterior.variance(nodes) - posterior.variance(places))
            .cwiseAbs()
            .maxCoeff();
    // 1e-12: rounding of 2 x 40 x 40 products of numbers near 1.
    EXPECT_LT(mean_error, tolerance * posterior.norm * kSigma + 1e-12) << width;
    EXPECT_LT(variance_error, tolerance * kSigma * kSigma + 1e-12) << width;
    EXPECT_LE(nodes.cols(), width < 0.5 ? 17 * 17 : 45 * 45) << width;  // at 1e-8; see the bound
    EXPECT_FALSE(box.fit(places, kLengths, {tolerance, tolerance}, nodes.cols() - 1)) << width;
  }
}

INSTANTIATE_TEST_SUITE_P(Tolerances, InterpolationBoxTest, ::testing::Values(1e-2, 1e-4, 1e-8));

TEST(InterpolationBox, ErrsMoreWithALooserTolerance) {
  field_core::Random random(12);
  const Eigen::Matrix2Xd places = uniform(random, kPlaces, 0.8 * kLengths);
  const Posterior posterior(random);
  InterpolationBox box;
  double before = 0.0;
  for (const double tolerance : {1e-8, 1e-5, 1e-2}) {
    ASSERT_TRUE(box.fit(places, kLengths, {tolerance, tolerance}, kMost));
    const Eigen::Matrix2Xd nodes = box.nodes();
    const Eigen::Map<const Eigen::MatrixXd> coefficients(box.coefficients().data(), kPlaces,
                                                         nodes.cols());
    const double error =
        (coefficients * posterior.variance(nodes) - posterior.variance(places)).norm();
    EXPECT_GT(error, 10.0 * before) << tolerance;
    before = error;
  }
}

}  // namespace
