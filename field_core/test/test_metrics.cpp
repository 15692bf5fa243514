#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "field_core/errors.hpp"
#include "field_core/metrics.hpp"
#include "field_core/random.hpp"
#include "support.hpp"

namespace field_core {
namespace {

Stamp seconds(double s) { return stamp_from_seconds(s); }

Trajectory path_of(const std::vector<Eigen::Vector3d>& poses) {
  Trajectory path;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    path.push_back({seconds(static_cast<double>(i)), SE2(poses[i]), std::nullopt});
  }
  return path;
}

// A robot that drives figures of eight, one pose per second.
Trajectory figure_eight(int poses) {
  Trajectory path;
  SE2 pose;
  for (int i = 0; i < poses; ++i) {
    path.push_back({seconds(i), pose, std::nullopt});
    pose = pose * SE2(0.5, 0.0, 0.2 * std::sin(0.05 * i) + 0.05);
  }
  return path;
}

TEST(ErrorStatistics, HandComputed) {
  const ErrorStatistics s = error_statistics({4.0, 1.0, 3.0, 2.0});
  EXPECT_DOUBLE_EQ(s.mean, 2.5);
  EXPECT_DOUBLE_EQ(s.median, 2.5);
  EXPECT_DOUBLE_EQ(s.rmse, std::sqrt(7.5));
  EXPECT_NEAR(s.p95, 3.85, 1e-14);  // rank 0.95 * 3 = 2.85
  EXPECT_DOUBLE_EQ(s.max, 4.0);
  EXPECT_DOUBLE_EQ(s.final, 2.0);
  EXPECT_DOUBLE_EQ(error_statistics({5.0}).p95, 5.0);
  EXPECT_TRUE(std::isnan(error_statistics({}).mean));
}

TEST(Compare, HandComputedErrors) {
  const Trajectory truth = path_of({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}});
  const Trajectory estimate = path_of({{0, 0, 0}, {1, 1, 0.5}, {2, 0, -0.5}, {6, 4, 0}});
  const TrajectoryErrors e = compare(truth, estimate, Alignment::none, 1.0);
  EXPECT_EQ(e.poses, 4u);
  EXPECT_EQ(e.position_errors, (std::vector<double>{0, 1, 0, 5}));
  EXPECT_DOUBLE_EQ(e.position.mean, 1.5);
  EXPECT_DOUBLE_EQ(e.position.rmse, std::sqrt(26.0 / 4.0));
  EXPECT_DOUBLE_EQ(e.position.final, 5.0);
  EXPECT_DOUBLE_EQ(e.yaw.mean, 0.25);
  // First relative motion: (1, 1) instead of (1, 0); errors of yaw 0.5, 1.0, 0.5.
  EXPECT_DOUBLE_EQ(e.relative_distance, 1.0);
  EXPECT_NEAR(e.relative_yaw.mean, 2.0 / 3.0, 1e-14);
  EXPECT_NEAR(e.relative_yaw.max, 1.0, 1e-14);
  EXPECT_FALSE(e.nees);
  EXPECT_FALSE(e.share_inside_90_ellipse);
  const Trajectory first_two(estimate.begin(), estimate.begin() + 2);
  EXPECT_NEAR(compare(truth, first_two, Alignment::none, 1.0).relative_position.mean, 1.0, 1e-14);
}

TEST(Compare, TruthIsInterpolatedAndTheRestLeftOut) {
  const Trajectory truth = path_of({{0, 0, 0}, {2, 0, 0}});
  const Trajectory estimate = {{seconds(-1), SE2(9, 9, 0), std::nullopt},
                               {seconds(0.25), SE2(0.5, 0, 0), std::nullopt},
                               {seconds(2), SE2(9, 9, 0), std::nullopt}};
  const TrajectoryErrors e = compare(truth, estimate, Alignment::none);
  ASSERT_EQ(e.poses, 1u);
  EXPECT_NEAR(e.position.max, 0.0, 1e-14);
  EXPECT_TRUE(std::isnan(e.relative_position.mean));  // nothing was driven between one pose
}

TEST(Compare, AlignmentRecoversAKnownMotion) {
  const Trajectory truth = figure_eight(200);
  const SE2 offset(3.0, -2.0, 2.9);
  Trajectory estimate = truth;
  for (auto& pose : estimate) pose.pose = offset * pose.pose;
  for (const auto alignment : {Alignment::first, Alignment::best}) {
    const TrajectoryErrors e = compare(truth, estimate, alignment);
    EXPECT_NEAR(e.position.max, 0.0, 1e-12);
    EXPECT_NEAR(e.yaw.max, 0.0, 1e-12);
    EXPECT_NEAR((e.alignment * offset).vector().norm(), 0.0, 1e-12);
  }
  const TrajectoryErrors none = compare(truth, estimate, Alignment::none);
  EXPECT_GT(none.position.mean, 1.0);
  EXPECT_NEAR(none.relative_position.max, 0.0, 1e-12);  // relative errors know no frame
}

// Moving the optimum any way makes the sum of squares larger: what "best" promises.
TEST(Compare, BestAlignmentIsTheLeastSquaresOne) {
  const Trajectory truth = figure_eight(100);
  Trajectory estimate = truth;
  Random random(60);
  for (auto& pose : estimate) {
    pose.pose = SE2(pose.pose.x() + random.normal(), pose.pose.y() + random.normal(), 0.0);
  }
  const TrajectoryErrors best = compare(truth, estimate, Alignment::best);
  for (int k = 0; k < 20; ++k) {
    const SE2 nudge(0.01 * random.normal(), 0.01 * random.normal(), 0.01 * random.normal());
    Trajectory moved = estimate;
    for (auto& pose : moved) pose.pose = nudge * (best.alignment * pose.pose);
    EXPECT_GT(compare(truth, moved, Alignment::none).position.rmse, best.position.rmse);
  }
}

// Errors drawn from the covariance that is claimed: NEES must be 3, and the ellipse hold 90 %.
// Bounds: 4.5 standard errors; NEES has variance 2 * 3, NEES of the position 2 * 2.
TEST(Compare, ConsistencyOfAKnownGaussian) {
  constexpr int n = 20000;
  Eigen::Matrix3d covariance;
  covariance << 0.04, 0.01, 0.002, 0.01, 0.09, -0.003, 0.002, -0.003, 0.01;
  const Trajectory truth = figure_eight(n);
  Trajectory estimate = truth;
  Random random(61);
  for (auto& pose : estimate) {
    pose.pose = SE2(Eigen::Vector3d(pose.pose.vector() + random.normal3(covariance)));
    pose.covariance = covariance;
  }
  const TrajectoryErrors e = compare(truth, estimate, Alignment::none);
  EXPECT_NEAR(*e.nees, 3.0, 4.5 * std::sqrt(6.0 / n));
  EXPECT_NEAR(*e.nees_position, 2.0, 4.5 * std::sqrt(4.0 / n));
  EXPECT_NEAR(*e.share_inside_90_ellipse, 0.9, 4.5 * std::sqrt(0.09 / n));
  // In another frame the covariance must turn with the estimate: first pose left exact.
  const SE2 offset(5.0, 1.0, 1.1);
  estimate.front() = truth.front();
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn.topLeftCorner<2, 2>() = offset.rotation();
  for (auto& pose : estimate) {
    pose.pose = offset * pose.pose;
    if (pose.covariance) pose.covariance = turn * *pose.covariance * turn.transpose();
  }
  EXPECT_NEAR(*compare(truth, estimate, Alignment::first).nees, 3.0, 4.5 * std::sqrt(6.0 / n));
}

TEST(Compare, UnusableInputIsATypedError) {
  const Trajectory truth = path_of({{0, 0, 0}, {1, 0, 0}});
  Trajectory late = truth;
  for (auto& pose : late) pose.stamp += seconds(100);
  test::expect_error<DataError>([&] { compare(truth, late, Alignment::none); },
                                {"100.000000000", "same clock"});
  Trajectory singular = truth;
  singular[1].covariance = Eigen::Vector3d(1.0, 1.0, 0.0).asDiagonal();
  test::expect_error<NumericalError>([&] { compare(truth, singular, Alignment::none); },
                                     {"1.000000000", "not positive definite"});
}

TEST(NegativeLogPredictiveDensity, HandComputed) {
  const Eigen::Vector2d values(1.0, 3.0), means(1.0, 1.0), variances(1.0, 4.0);
  // 1/2 log(2 pi) and 1/2 log(8 pi) + 1/2
  const double expected = 0.5 * (0.5 * std::log(2 * M_PI) + 0.5 * std::log(8 * M_PI) + 0.5);
  EXPECT_NEAR(negative_log_predictive_density(values, means, variances), expected, 1e-15);
  const auto nlpd = [&](const Eigen::VectorXd& v, const Eigen::VectorXd& variance) {
    return [=] { negative_log_predictive_density(v, means, variance); };
  };
  test::expect_error<NumericalError>(nlpd(values, Eigen::Vector2d(1.0, 0.0)), {"value 1"});
  test::expect_error<NumericalError>(nlpd(Eigen::Vector3d::Zero(), variances), {"(3)", "(2)"});
}

TEST(DeadReckoning, FollowsTheIncrementsFromAnyStart) {
  const Trajectory odometry = path_of({{5, 5, M_PI / 2}, {5, 6, M_PI / 2}, {4, 6, M_PI}});
  const Trajectory path = dead_reckoning(odometry, SE2(), 2.0);
  // One ahead; then left by one with a quarter turn: (1, 0), (1, 1); all lengths doubled.
  EXPECT_NEAR((path[1].pose.vector() - Eigen::Vector3d(2, 0, 0)).norm(), 0.0, 1e-14);
  EXPECT_NEAR((path[2].pose.vector() - Eigen::Vector3d(2, 2, M_PI / 2)).norm(), 0.0, 1e-14);
  EXPECT_EQ(path[2].stamp, odometry[2].stamp);
  EXPECT_TRUE(dead_reckoning({}, SE2()).empty());
}

TEST(DeadReckoning, BestScaleUndoesAMiscalibratedOdometer) {
  const Trajectory truth = figure_eight(300);
  for (const double scale : {0.6, 1.0, 1.3, 1.9}) {
    // The odometer reads 1/scale of each step, in a frame of its own, and began a minute earlier.
    Trajectory odometry = dead_reckoning(truth, SE2(-7.0, 2.0, 2.0), 1.0 / scale);
    odometry.insert(odometry.begin(), {seconds(-60), SE2(40, 40, 0), std::nullopt});
    EXPECT_NEAR(best_translation_scale(truth, odometry), scale, 1e-4);
    const auto path = dead_reckoning_from_truth(truth, odometry, scale);
    EXPECT_NEAR(compare(truth, path, Alignment::none).position.max, 0.0, 1e-9);
  }
  test::expect_error<DataError>([&] { dead_reckoning_from_truth({}, truth); }, {"same clock"});
}

}  // namespace
}  // namespace field_core
