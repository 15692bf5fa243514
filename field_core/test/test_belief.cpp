#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "field_core/belief.hpp"
#include "field_core/errors.hpp"
#include "field_core/random.hpp"
#include "support.hpp"

namespace field_core {
namespace {

TEST(SummarizeParticles, HandComputedWithWeightsThatDoNotSumToOne) {
  SE2 mean;
  Eigen::Matrix3d covariance;
  summarize_particles({{SE2(0, 0, 0.1), 3.0}, {SE2(4, 8, 0.1), 1.0}}, mean, covariance);
  EXPECT_NEAR((mean.vector() - Eigen::Vector3d(1, 2, 0.1)).norm(), 0.0, 1e-14);
  // 3/4 * 1 + 1/4 * 9 = 3; cross 3/4 * 2 + 1/4 * 18 = 6; 3/4 * 4 + 1/4 * 36 = 12
  EXPECT_NEAR(covariance(0, 0), 3.0, 1e-11);
  EXPECT_NEAR(covariance(0, 1), 6.0, 1e-11);
  EXPECT_NEAR(covariance(1, 1), 12.0, 1e-11);
  EXPECT_NEAR(covariance(2, 2), kMinimumPoseVariance, 1e-15);
}

TEST(SummarizeParticles, YawIsCircular) {
  SE2 mean;
  Eigen::Matrix3d covariance;
  summarize_particles({{SE2(0, 0, M_PI - 0.1), 1.0}, {SE2(0, 0, -M_PI + 0.1), 1.0}}, mean,
                      covariance);
  EXPECT_NEAR(std::abs(mean.yaw()), M_PI, 1e-14);
  EXPECT_NEAR(covariance(2, 2), 0.01, 1e-11);
}

TEST(SummarizeParticles, CovarianceIsPositiveDefiniteEvenForOneParticle) {
  SE2 mean;
  Eigen::Matrix3d covariance;
  summarize_particles({{SE2(1, 2, 3), 1.0}}, mean, covariance);
  EXPECT_EQ(covariance, (kMinimumPoseVariance * Eigen::Matrix3d::Identity()).eval());
  Random random(70);
  std::vector<WeightedPose> particles;
  for (int k = 0; k < 1000; ++k) {
    particles.push_back({SE2(random.normal(), random.normal(), random.normal()), random.uniform()});
  }
  summarize_particles(particles, mean, covariance);
  EXPECT_EQ(covariance, covariance.transpose().eval());
  EXPECT_EQ(covariance.llt().info(), Eigen::Success);
}

TEST(SummarizeParticles, NoWeightIsATypedError) {
  SE2 mean;
  Eigen::Matrix3d covariance;
  const auto summarize = [&](const std::vector<WeightedPose>& p) {
    return [&mean, &covariance, p] { summarize_particles(p, mean, covariance); };
  };
  test::expect_error<NumericalError>(summarize({}), {"weights", "noise_stddev"});
  test::expect_error<NumericalError>(summarize({{SE2(), 0.0}}), {"weights"});
  test::expect_error<NumericalError>(summarize({{SE2(), std::nan("")}}), {"weights"});
}

}  // namespace
}  // namespace field_core
