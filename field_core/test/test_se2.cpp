#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "field_core/random.hpp"
#include "field_core/se2.hpp"
#include "support.hpp"

namespace field_core {
namespace {

// Products of a few numbers below 20 lose a few units in the last place of 100.
constexpr double kTolerance = 1e-12;

// The homogeneous matrix: the definition that SE2's arithmetic is checked against.
Eigen::Matrix3d matrix(const SE2& p) {
  Eigen::Matrix3d m = Eigen::Matrix3d::Identity();
  m << std::cos(p.yaw()), -std::sin(p.yaw()), p.x(), std::sin(p.yaw()), std::cos(p.yaw()), p.y(), 0,
      0, 1;
  return m;
}

void expect_same(const SE2& a, const SE2& b, double tolerance = kTolerance) {
  EXPECT_NEAR((matrix(a) - matrix(b)).cwiseAbs().maxCoeff(), 0.0, tolerance);
}

// Random poses, every other one with a yaw that is tiny or within a hair of +-pi.
SE2 random_pose(Random& random, int k) {
  double yaw = random.uniform(-M_PI, M_PI);
  const double hair = std::pow(10.0, random.uniform(-12.0, -1.0)) * (k % 4 < 2 ? 1.0 : -1.0);
  if (k % 4 == 1) yaw = hair;
  if (k % 4 == 3) yaw = M_PI + hair;
  return SE2(random.uniform(-10.0, 10.0), random.uniform(-10.0, 10.0), yaw);
}

TEST(Se2, GroupLawsHoldForRandomPoses) {
  Random random(1);
  for (int k = 0; k < 400; ++k) {
    SCOPED_TRACE(k);
    const SE2 a = random_pose(random, k), b = random_pose(random, k / 4),
              c = random_pose(random, 0);
    expect_same((a * b) * c, a * (b * c));
    expect_same(a * a.inverse(), SE2());
    expect_same(a.inverse() * a, SE2());
    expect_same(a * SE2(), a);
    expect_same(a * a.between(b), b);
    EXPECT_NEAR((matrix(a * b) - matrix(a) * matrix(b)).norm(), 0.0, kTolerance);
    const Eigen::Vector2d p(1.5, -2.0);
    EXPECT_NEAR((a * p - (matrix(a) * p.homogeneous()).hnormalized()).norm(), 0.0, kTolerance);
    EXPECT_GT((a * b).yaw(), -M_PI);
    EXPECT_LE((a * b).yaw(), M_PI);
  }
}

TEST(Se2, LogIsTheInverseOfExp) {
  Random random(2);
  for (int k = 0; k < 400; ++k) {
    SCOPED_TRACE(k);
    const SE2 a = random_pose(random, k);
    expect_same(SE2::exp(a.log()), a);
    const Eigen::Vector3d v(random.normal(), random.normal(), a.yaw());
    EXPECT_NEAR((SE2::exp(v).log() - v).norm(), 0.0, kTolerance);
  }
}

// The matrix exponential by its power series: another road to the same thing.
TEST(Se2, ExpIsTheMatrixExponential) {
  for (const double w : {0.0, 1e-9, 0.9e-4, 1.1e-4, 0.3, -2.0, M_PI}) {
    const Eigen::Vector3d v(0.7, -1.2, w);
    Eigen::Matrix3d hat;
    hat << 0, -w, v.x(), w, 0, v.y(), 0, 0, 0;
    Eigen::Matrix3d sum = Eigen::Matrix3d::Identity(), term = sum;
    for (int n = 1; n < 60; ++n) {
      term = term * hat / n;
      sum += term;
    }
    EXPECT_NEAR((matrix(SE2::exp(v)) - sum).norm(), 0.0, 1e-14) << "omega " << w;
  }
}

TEST(Se2, AdjointMovesTangentsToTheIdentity) {
  Random random(3);
  for (int k = 0; k < 100; ++k) {
    const SE2 a = random_pose(random, k);
    const Eigen::Vector3d v(random.normal(), random.normal(), 0.3 * random.normal());
    expect_same(SE2::exp(a.adjoint() * v) * a, a * SE2::exp(v), 1e-11);
  }
}

TEST(Se2, ComposeJacobiansAgreeWithDifferences) {
  Random random(4);
  for (int k = 0; k < 50; ++k) {
    // Within +-1 rad each, so that the sum of yaws does not wrap between differences.
    const SE2 a(random.normal(), random.normal(), random.uniform(-1.0, 1.0));
    const SE2 b(random.normal(), random.normal(), random.uniform(-1.0, 1.0));
    const auto first = test::central_differences(
        [&](const Eigen::Vector3d& v) { return (SE2(v) * b).vector(); }, a.vector());
    const auto second = test::central_differences(
        [&](const Eigen::Vector3d& v) { return (a * SE2(v)).vector(); }, b.vector());
    EXPECT_NEAR((SE2::compose_jacobian_first(a, b) - first).norm(), 0.0, test::kDifferenceError);
    EXPECT_NEAR((SE2::compose_jacobian_second(a, b) - second).norm(), 0.0, test::kDifferenceError);
  }
}

TEST(Se2, InterpolationFollowsOneArc) {
  // A quarter of a circle of radius 2 around (0, 2): half way is at 45 degrees.
  const SE2 start, end(2.0, 2.0, M_PI / 2);
  expect_same(interpolate(start, end, 0.5),
              SE2(2.0 * std::sin(M_PI / 4), 2.0 - 2.0 * std::cos(M_PI / 4), M_PI / 4));
  expect_same(interpolate(start, end, 0.0), start, 0.0);
  expect_same(interpolate(start, end, 1.0), end, 0.0);
  // Across the seam of the yaw the short way is taken.
  EXPECT_NEAR(std::abs(interpolate(SE2(0, 0, 3.0), SE2(0, 0, -3.0), 0.5).yaw()), M_PI, kTolerance);
}

TEST(WrapAngle, IsInTheHalfOpenIntervalAndKeepsTheDirection) {
  EXPECT_EQ(wrap_angle(-M_PI), M_PI);
  EXPECT_EQ(wrap_angle(M_PI), M_PI);
  EXPECT_NEAR(wrap_angle(1.5 * M_PI), -0.5 * M_PI, 1e-15);
  for (double angle = -20.0; angle < 20.0; angle += 0.37) {
    const double wrapped = wrap_angle(angle);
    EXPECT_GT(wrapped, -M_PI);
    EXPECT_LE(wrapped, M_PI);
    EXPECT_NEAR(std::sin(wrapped), std::sin(angle), 1e-14);
    EXPECT_NEAR(std::cos(wrapped), std::cos(angle), 1e-14);
  }
}

}  // namespace
}  // namespace field_core
