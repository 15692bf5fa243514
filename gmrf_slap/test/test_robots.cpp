// Robots that differ in start, odometry and sensors, as robot_models says; observations of
// positions through the estimator's interface.
#include <gtest/gtest.h>

#include "field_core/errors.hpp"
#include "gmrf_slap/gmrf_slap.hpp"
#include "small_worlds.hpp"

using namespace gmrf_slap;
using Eigen::Vector2d;

namespace {

GmrfSlapParams two_robots() {
  auto p = test::small_world(12, 9, {test::theta(1.0, 0.2)});
  p.robots = {"anna", "bert"};
  p.particles = 400;
  p.position_stddev = 2.0;
  p.initial_pose_x = p.initial_pose_y = 3.0;
  p.initial_cov_xx = p.initial_cov_yy = 1.0;
  RobotModelParams& bert = p.robot_models["bert"];
  bert.initial_pose = {7.0, 5.0, 1.0};
  bert.initial_variance = {0.04, 0.04, 0.0};
  bert.odom_alpha = {0.0, 0.0, 0.25, 0.0};
  bert.position_stddev = 0.1;
  bert.fields["a"].measurement_stddev = 3.0;
  return p;
}

std::string refusal(const GmrfSlapParams& params) {
  try {
    params.validate();
  } catch (const field_core::ParameterError& e) {
    return e.what();
  }
  return "accepted";
}

TEST(Robots, StartMoveAndMeasureAsTheirModelsSay) {
  GmrfSlap slap(two_robots(), 1);
  EXPECT_EQ((std::vector<std::string>{"anna", "bert"}), slap.robots());
  // 400 particles with standard deviations of 1 and 0.2 m: their mean is off by 0.05 and 0.01 m.
  EXPECT_LT((slap.belief(0).mean.translation() - Vector2d(3.0, 3.0)).norm(), 0.2);
  EXPECT_LT((slap.belief(1).mean.translation() - Vector2d(7.0, 5.0)).norm(), 0.04);
  EXPECT_NEAR(1.0, slap.belief(1).mean.yaw(), 1e-9);
  EXPECT_NEAR(1.0, slap.belief(0).covariance(0, 0), 0.3);
  EXPECT_NEAR(0.04, slap.belief(1).covariance(0, 0), 0.012);
  // Along its heading bert's variance grows by (0.5 x 2 m)^2, across and anna's not at all.
  const auto before = slap.belief(0).covariance;
  for (int robot : {0, 1}) slap.predict(test::motion(2.0, 0.0, 0.0), robot);
  EXPECT_NEAR(before(0, 0), slap.belief(0).covariance(0, 0), 1e-9);
  const Vector2d along(std::cos(1.0), std::sin(1.0)), across(-along.y(), along.x());
  const Eigen::Matrix2d spread = slap.belief(1).covariance.topLeftCorner<2, 2>();
  EXPECT_NEAR(1.04, along.dot(spread * along), 0.3);
  EXPECT_NEAR(0.04, across.dot(spread * across), 0.012);
}

TEST(Robots, NoiseOfMeasurementsIsEachRobotsOwn) {
  auto params = two_robots();
  params.robot_models["bert"].initial_pose = {3.0, 3.0, 0.0};
  params.robot_models["bert"].initial_variance = {0.0, 0.0, 0.0};
  params.initial_cov_xx = params.initial_cov_yy = 0.0;
  const auto variance_after = [&](int robot) {
    GmrfSlap slap(params, 1);
    EXPECT_TRUE(slap.update(test::sample_of({{0, 1.0, 0.0}}), robot).applied);
    return slap.predict_field(Vector2d(3.0, 3.0)).variance(0, 0) - 0.09;
  };
  const double prior = GmrfSlap(params, 1).predict_field(Vector2d(3.0, 3.0)).variance(0, 0) - 0.09;
  // One Gaussian measurement: 1 / posterior = 1 / prior + 1 / noise.
  EXPECT_NEAR(1.0 / (1.0 / prior + 1.0 / 0.09), variance_after(0), 1e-9);
  EXPECT_NEAR(1.0 / (1.0 / prior + 1.0 / 9.0), variance_after(1), 1e-9);
}

TEST(Robots, ObservationsOfThePositionHaveTheRobotsNoise) {
  GmrfSlap slap(two_robots(), 1);
  for (int robot : {0, 1}) {
    const Vector2d there = slap.belief(robot).mean.translation();
    const auto seen = slap.observe_position({there, Eigen::Matrix2d::Zero()}, robot);
    EXPECT_TRUE(seen.applied);
    EXPECT_EQ(2, seen.nis_dof);
  }
  // Kalman: 1 / (1 / 1 + 1 / 4) and 1 / (1 / 0.04 + 1 / 0.01); 20 % for 400 weighted particles.
  EXPECT_NEAR(0.8, slap.belief(0).covariance(0, 0), 0.2);
  EXPECT_NEAR(0.008, slap.belief(1).covariance(0, 0), 0.003);
  const Vector2d far = slap.belief(1).mean.translation() + Vector2d(0.0, 100.0 * 0.2);
  const auto off = slap.observe_position({far, 0.01 * Eigen::Matrix2d::Identity()}, 1);
  EXPECT_FALSE(off.applied);
  EXPECT_STREQ("position observation off the belief", off.reason);
}

TEST(Robots, OnesPoseIsNoneOfTheOthersBusiness) {
  GmrfSlap slap(two_robots(), 1);
  const auto anna = slap.belief(0);
  slap.scatter(1);
  EXPECT_GT(slap.belief(1).covariance(0, 0), 4.0);
  slap.set_pose(field_core::SE2(1.0, 1.0, 0.0), 0.01 * Eigen::Matrix3d::Identity(), 1);
  EXPECT_LT((slap.belief(1).mean.translation() - Vector2d(1.0, 1.0)).norm(), 0.05);
  EXPECT_EQ(anna.mean.vector(), slap.belief(0).mean.vector());
}

TEST(Robots, StatesHoldAllOfThem) {
  GmrfSlap a(two_robots(), 1), b(two_robots(), 2);
  for (int robot : {0, 1}) a.update(test::sample_of({{0, 1.0, 0.0}}), robot);
  b.restore(a.state());
  for (int robot : {0, 1}) {
    EXPECT_EQ(a.belief(robot).mean.vector(), b.belief(robot).mean.vector());
    EXPECT_EQ(a.belief(robot).covariance, b.belief(robot).covariance);
  }
}

TEST(Robots, RefusesModelsThatFitNothing) {
  EXPECT_EQ("accepted", refusal(two_robots()));
  auto p = two_robots();
  p.robot_models["carl"] = {};
  EXPECT_NE(std::string::npos, refusal(p).find("'robot_models/carl': is none of the robots"))
      << refusal(p);
  p = two_robots();
  p.robot_models["bert"].fields["smell"] = {};
  EXPECT_NE(std::string::npos, refusal(p).find("is none of the fields")) << refusal(p);
  RobotModelParams model;
  model.initial_pose = {1.0, 2.0};
  EXPECT_THROW(model.validate(), field_core::ParameterError);
  model = {};
  model.odom_alpha = {0.1};
  EXPECT_THROW(model.validate(), field_core::ParameterError);
}

}  // namespace
