#include <gtest/gtest.h>

#include <cmath>

#include "field_core/odometry_motion_model.hpp"
#include "support.hpp"

namespace field_core {
namespace {

OdometryMotion motion_of(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }

TEST(OdometryMotion, DecompositionIsTheInverseOfDelta) {
  Random random(20);
  for (int k = 0; k < 500; ++k) {
    const SE2 delta(random.normal(), random.normal(), random.uniform(-M_PI, M_PI));
    const OdometryMotion motion = OdometryMotion::from(delta);
    const SE2 back = motion.delta();
    EXPECT_NEAR((back.translation() - delta.translation()).norm(), 0.0, 1e-14);
    EXPECT_NEAR(wrap_angle(back.yaw() - delta.yaw()), 0.0, 1e-14);
    EXPECT_LE(std::abs(motion.rot1), M_PI / 2 + 1e-15);
  }
}

TEST(OdometryMotion, HandComputedMotions) {
  const OdometryMotion arc = OdometryMotion::from(SE2(1.0, 1.0, M_PI / 2));
  EXPECT_NEAR(arc.rot1, M_PI / 4, 1e-15);
  EXPECT_NEAR(arc.trans, std::sqrt(2.0), 1e-15);
  EXPECT_NEAR(arc.rot2, M_PI / 4, 1e-15);

  const OdometryMotion back = OdometryMotion::from(SE2(-1.0, 0.0, 0.1));
  EXPECT_NEAR(back.rot1, 0.0, 1e-15);
  EXPECT_NEAR(back.trans, -1.0, 1e-15);
  EXPECT_NEAR(back.rot2, 0.1, 1e-15);

  const OdometryMotion turn = OdometryMotion::from(SE2(1e-7, -1e-7, 3.0));
  EXPECT_EQ(turn.rot1, 0.0);
  EXPECT_EQ(turn.trans, 0.0);
  EXPECT_EQ(turn.rot2, 3.0);
}

TEST(OdometryMotionModel, VariancesAreAmclsTerms) {
  const OdometryMotionModel model({0.1, 0.02, 0.3, 0.04});
  const Eigen::Vector3d v = model.variances({0.5, -2.0, 1.0});
  EXPECT_NEAR(v[0], 0.1 * 0.25 + 0.02 * 4.0, 1e-15);
  EXPECT_NEAR(v[1], 0.3 * 4.0 + 0.04 * (0.25 + 1.0), 1e-15);
  EXPECT_NEAR(v[2], 0.1 * 1.0 + 0.02 * 4.0, 1e-15);
}

// Reversing straight must not be as noisy as two half turns.
TEST(OdometryMotionModel, ReversingIsAsNoisyAsDriving) {
  const OdometryMotionModel model({0.2, 0.01, 0.1, 0.2});
  const auto forward = model.variances(OdometryMotion::from(SE2(1.0, 0.0, 0.0)));
  const auto backward = model.variances(OdometryMotion::from(SE2(-1.0, 0.0, 0.0)));
  EXPECT_NEAR((forward - backward).norm(), 0.0, 1e-15);
}

TEST(OdometryMotionModel, JacobiansAgreeWithDifferences) {
  Random random(21);
  const OdometryMotionModel model({});
  for (int k = 0; k < 50; ++k) {
    // Yaw and turns of at most 1 rad together stay clear of the seam at pi.
    const SE2 pose(random.normal(), random.normal(), random.uniform(-1.0, 1.0));
    const Eigen::Vector3d m(random.uniform(-1.0, 1.0), random.normal(), random.uniform(-1.0, 1.0));
    const MotionPrediction p = model.predict(pose, motion_of(m));
    const auto by_pose = test::central_differences(
        [&](const Eigen::Vector3d& v) { return (SE2(v) * motion_of(m).delta()).vector(); },
        pose.vector());
    const auto by_motion = test::central_differences(
        [&](const Eigen::Vector3d& v) { return (pose * motion_of(v).delta()).vector(); }, m);
    EXPECT_NEAR((p.pose_jacobian - by_pose).norm(), 0.0, test::kDifferenceError);
    EXPECT_NEAR((p.motion_jacobian - by_motion).norm(), 0.0, test::kDifferenceError);
  }
}

// Sampled poses against predict(). For stddevs of about 0.01 the neglected second order is 1e-4 of
// the variance; the bounds are 4.5 standard errors of a sample covariance.
TEST(OdometryMotionModel, SamplesHaveThePredictedMoments) {
  const OdometryMotionModel model({1e-4, 5e-5, 2e-4, 1e-4});
  constexpr int n = 100000;
  for (const SE2& delta : {SE2(1.0, 0.4, 0.7), SE2(-1.0, 0.2, 0.3), SE2(0.0, 0.0, 1.2)}) {
    const SE2 pose(3.0, -1.0, 0.8);
    const OdometryMotion motion = OdometryMotion::from(delta);
    const MotionPrediction predicted = model.predict(pose, motion);
    const Eigen::Matrix3d expected = predicted.covariance(Eigen::Matrix3d::Zero());
    Random random(22);
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    Eigen::Matrix3d sample = Eigen::Matrix3d::Zero();
    for (int k = 0; k < n; ++k) {
      Eigen::Vector3d d = model.sample(pose, motion, random).vector() - predicted.mean.vector();
      d[2] = wrap_angle(d[2]);
      mean += d / n;
      sample += d * d.transpose() / n;
    }
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(mean[i], 0.0, 4.5 * std::sqrt(expected(i, i) / n) + 1e-4);
      for (int j = 0; j < 3; ++j) {
        const double scale = expected(i, i) * expected(j, j);
        const double standard_error = std::sqrt((scale + expected(i, j) * expected(i, j)) / n);
        EXPECT_NEAR(sample(i, j), expected(i, j), 4.5 * standard_error + 1e-3 * std::sqrt(scale));
      }
    }
  }
}

TEST(OdometryMotionModel, CovarianceOfThePoseBeforeIsCarriedAlong) {
  const OdometryMotionModel model({0, 0, 0, 0});
  Eigen::Matrix3d before = Eigen::Matrix3d::Zero();
  before(2, 2) = 0.01;  // yaw only: after 2 m ahead it is 2 * 0.1 m across
  const auto p = model.predict(SE2(), OdometryMotion::from(SE2(2.0, 0.0, 0.0)));
  const Eigen::Matrix3d after = p.covariance(before);
  EXPECT_NEAR(after(1, 1), 0.04, 1e-15);
  EXPECT_NEAR(after(1, 2), 0.02, 1e-15);
  EXPECT_NEAR(after(0, 0), 0.0, 1e-15);
}

TEST(OdometryMotionModel, WithoutNoiseSamplingIsExact) {
  const OdometryMotionModel model({0, 0, 0, 0});
  Random random(23);
  for (const SE2& delta : {SE2(0.3, 0.1, -0.2), SE2(-0.5, 0.0, 0.0), SE2(0.0, 0.0, 2.0)}) {
    const OdometryMotion motion = OdometryMotion::from(delta);
    const SE2 pose(1.0, 2.0, 0.5);
    EXPECT_EQ(model.sample(pose, motion, random).vector(), (pose * motion.delta()).vector());
    EXPECT_EQ(model.predict(pose, motion).motion_noise, Eigen::Matrix3d::Zero());
  }
}

}  // namespace
}  // namespace field_core
