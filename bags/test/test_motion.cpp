// Routes, the true motion along them and the odometer.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "field_bags/drive.hpp"
#include "field_bags/odometer.hpp"
#include "field_bags/route.hpp"
#include "field_core/errors.hpp"

namespace field_bags {
namespace {

using Eigen::Vector2d;
using field_core::SE2;

double length(const std::vector<Vector2d>& points) {
  double sum = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i) sum += (points[i] - points[i - 1]).norm();
  return sum;
}

TEST(Route, LoopIsClosedAndLongEnough) {
  RouteParams params;
  params.waypoints = {{0, 0}, {4, 0}, {4, 3}};
  field_core::Random random(1);
  const auto route = make_route(params, {-9, -9, 9, 9}, 30.0, random);
  EXPECT_GE(length(route), 30.0);
  EXPECT_LE(length(route), 30.0 + 2 * 12.0);  // whole laps of 4 + 3 + 5
  EXPECT_EQ(route[3], route[0]);
  params.waypoints.push_back({0, 0});
  EXPECT_THROW(make_route(params, {-9, -9, 9, 9}, 30.0, random), field_core::ParameterError);
}

TEST(Route, LawnMowerCoversTheAreaInBothDirections) {
  RouteParams params;
  params.kind = RouteKind::lawn_mower;
  params.spacing = 1.0;
  params.margin = 0.5;
  field_core::Random random(1);
  const auto route = make_route(params, {0, 0, 6, 4}, 60.0, random);
  EXPECT_GE(length(route), 60.0);
  bool along_x = false, along_y = false;
  for (std::size_t i = 1; i < route.size(); ++i) {
    const Vector2d step = route[i] - route[i - 1];
    EXPECT_GT(step.norm(), 0.01);
    EXPECT_NEAR(step.x() * step.y(), 0.0, 1e-12) << "lanes follow the axes";
    along_x = along_x || std::abs(step.x()) == 5.0;
    along_y = along_y || std::abs(step.y()) == 3.0;
  }
  EXPECT_TRUE(along_x && along_y);
  for (double y = 0.5; y <= 3.5; y += 1.0) {  // a lane at every spacing
    EXPECT_TRUE(std::any_of(route.begin(), route.end(), [y](const Vector2d& p) {
      return std::abs(p.y() - y) < 1e-9;
    })) << y;
  }
}

TEST(Route, RandomWaypointsStayInside) {
  RouteParams params;
  params.kind = RouteKind::random_waypoints;
  params.margin = 1.0;
  field_core::Random random(1);
  for (const Vector2d& p : make_route(params, {-3, 0, 3, 4}, 200.0, random)) {
    EXPECT_TRUE(p.x() >= -2 && p.x() <= 2 && p.y() >= 1 && p.y() <= 3);
  }
  params.margin = 2.0;
  EXPECT_THROW(make_route(params, {-3, 0, 3, 4}, 9.0, random), field_core::ParameterError);
}

const std::vector<Vector2d> kCorner{{0, 0}, {4, 0}, {4, 3}};

TEST(Drive, TurnsInPlaceAtCorners) {
  DriveParams params;
  params.speed = 0.5;
  params.turn_rate = M_PI / 4;
  const Drive drive(kCorner, params);
  EXPECT_NEAR(drive.duration(), 8.0 + 2.0 + 6.0, 1e-12);
  EXPECT_NEAR((drive.at(3.0).vector() - Eigen::Vector3d(1.5, 0, 0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((drive.at(9.0).vector() - Eigen::Vector3d(4, 0, M_PI / 4)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((drive.at(12.0).vector() - Eigen::Vector3d(4, 1, M_PI / 2)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((drive.at(99.0).translation() - Vector2d(4, 3)).norm(), 0.0, 1e-12);
}

TEST(Drive, ArcsRoundACornerTangentially) {
  DriveParams params;
  params.speed = 0.5;
  params.turning = Turning::arcs;
  params.arc_radius = 1.0;
  const Drive drive(kCorner, params);
  // Lines of 3 m and 2 m and a quarter of a circle around (3, 1).
  EXPECT_NEAR(drive.duration(), (3.0 + 2.0 + M_PI / 2) / 0.5, 1e-12);
  const SE2 middle = drive.at((3.0 + M_PI / 4) / 0.5);
  EXPECT_NEAR(middle.x(), 3.0 + std::sqrt(0.5), 1e-12);
  EXPECT_NEAR(middle.y(), 1.0 - std::sqrt(0.5), 1e-12);
  EXPECT_NEAR(middle.yaw(), M_PI / 4, 1e-12);
  for (double t = 0.0; t + 0.01 < drive.duration(); t += 0.01) {
    const Eigen::Vector3d twist = drive.at(t).between(drive.at(t + 0.01)).log() / 0.01;
    EXPECT_NEAR(twist.x(), 0.5, 1e-3) << t;  // constant speed, up to the piece boundaries
    EXPECT_NEAR(twist.y(), 0.0, 2e-3) << t;  // never sideways
    EXPECT_LE(twist.z(), 0.5 + 1e-9) << t;   // speed / radius
  }
}

TEST(Drive, ShortLegsAndReversalsAreHandled) {
  DriveParams params;
  params.turning = Turning::arcs;
  params.arc_radius = 5.0;  // longer than any leg
  const Drive drive({{0, 0}, {1, 0}, {1, 1}, {1, 0}, {0, 0}}, params);
  EXPECT_NEAR((drive.at(drive.duration()).translation() - Vector2d(0, 0)).norm(), 0.0, 1e-9);
}

TEST(Odometer, ScalesAndDriftsAsDeclared) {
  OdometerParams params;
  params.translation_scale = 1.1;
  params.rotation_scale = 0.9;
  params.heading_drift = 0.01;
  field_core::Random random(1);
  const SE2 straight = reported_motion(SE2(2.0, 0, 0), params, random);
  EXPECT_NEAR(straight.log().x(), 2.2, 1e-12);
  EXPECT_NEAR(straight.yaw(), 0.02, 1e-12);
  EXPECT_NEAR(reported_motion(SE2(0, 0, 1.0), params, random).yaw(), 0.9, 1e-12);
}

TEST(Odometer, NoiseDoesNotDependOnTheRate) {
  OdometerParams params;
  params.translation_noise = 0.05;
  params.heading_noise = 0.02;
  field_core::Random random(2);
  constexpr int kRuns = 3000;
  for (const int steps : {2, 50}) {
    double distance = 0.0, heading = 0.0;
    for (int run = 0; run < kRuns; ++run) {
      double x = 0.0, yaw = 0.0;
      for (int i = 0; i < steps; ++i) {
        const Eigen::Vector3d twist = reported_motion(SE2(4.0 / steps, 0, 0), params, random).log();
        x += twist.x() - 4.0 / steps;
        yaw += twist.z();
      }
      distance += x * x / kRuns;
      heading += yaw * yaw / kRuns;
    }
    // Variances over 4 m; 4.5 sigma of a sample variance.
    const double relative = 4.5 * std::sqrt(2.0 / kRuns);
    EXPECT_NEAR(distance, 4 * 0.05 * 0.05, relative * 4 * 0.05 * 0.05) << steps;
    EXPECT_NEAR(heading, 4 * 0.02 * 0.02, relative * 4 * 0.02 * 0.02) << steps;
  }
}

}  // namespace
}  // namespace field_bags
