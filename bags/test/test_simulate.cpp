// A whole simulated run: stamps, frames, noise, dropouts, outliers.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "field_bags/simulate.hpp"

namespace field_bags {
namespace {

using field_core::SE2;

WorldParams small_world() {
  WorldParams world;
  world.duration = 2000.0;
  world.area = {-5, -5, 5, 5};
  world.route.kind = RouteKind::random_waypoints;
  world.gp_fields["light"].mean = 50.0;
  world.gp_fields["light"].length_scales = {2.0, 2.0};
  world.gp_fields["light"].noise_stddev = 0.5;
  return world;
}

/// Reading minus true value of the only channel, for every reading that is there.
std::vector<double> residuals(const WorldParams& params, std::uint64_t seed) {
  const Recording run = simulate(params, seed);
  const World world(params, seed);
  std::vector<double> all;
  for (const FieldRow& row : run.measurements) {
    const auto pose = field_core::pose_at(run.truth, row.stamp);
    if (!pose) continue;
    all.push_back(row.values[0] - world.values(*pose * run.sensor_in_base)[0]);
  }
  return all;
}

double mean_square(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double v : values) sum += v * v;
  return sum / static_cast<double>(values.size());
}

TEST(Simulate, PerfectOdometryIsTheTruthFromTheStart) {
  const Recording run = simulate(small_world(), 1);
  ASSERT_EQ(run.odometry.size(), 2000u * 5 + 1);
  ASSERT_EQ(run.truth.size(), run.odometry.size());
  EXPECT_EQ(run.odometry[0].pose.vector(), Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i < run.truth.size(); ++i) {
    EXPECT_EQ(run.truth[i].stamp, std::chrono::seconds(1000) + i * std::chrono::milliseconds(200));
    const SE2 pose = run.truth[0].pose * run.odometry[i].pose;
    // Rounding to 1e-6: of position, and of the start yaw over at most 15 m.
    ASSERT_LT((pose.translation() - run.truth[i].pose.translation()).norm(), 2e-5) << i;
  }
}

TEST(Simulate, ReadingsHaveTheNoiseOfTheirChannel) {
  const std::vector<double> errors = residuals(small_world(), 2);
  EXPECT_EQ(errors.size(), 2001u);
  EXPECT_NEAR(mean_square(errors), 0.25, 4.5 * 0.25 * std::sqrt(2.0 / 2001));
}

TEST(Simulate, SensorIsReadWhereItIsMounted) {
  WorldParams params = small_world();
  params.sensor.mounting = {1.5, 0.5, 0.3};
  const Recording run = simulate(params, 2);
  EXPECT_EQ(run.sensor_frame, "field_sensor");
  // residuals() places the sensor itself: at a wrong place they would be those of the field,
  // about 1.
  EXPECT_NEAR(mean_square(residuals(params, 2)), 0.25, 4.5 * 0.25 * std::sqrt(2.0 / 2001));
}

TEST(Simulate, DropoutsAndOutliersHaveTheirRates) {
  WorldParams params = small_world();
  params.sensor.dropout_probability = 0.2;
  params.sensor.outlier_probability = 0.1;
  params.sensor.outlier_size = 100.0;
  const std::vector<double> errors = residuals(params, 3);
  EXPECT_NEAR(static_cast<double>(errors.size()), 0.8 * 2001, 4.5 * std::sqrt(2001 * 0.16));
  double gross = 0.0;
  for (const double e : errors) gross += std::abs(e) > 2.5 ? 1.0 : 0.0;  // 5 sigma of plain noise
  // A gross error of 50 is below 2.5 in 4 % of cases: 0.096 of all are seen.
  const double n = static_cast<double>(errors.size());
  EXPECT_NEAR(gross / n, 0.096, 4.5 * std::sqrt(0.096 * 0.904 / n));
}

TEST(Simulate, WeakAccessPointsAreNotHeard) {
  WorldParams params = small_world();
  params.gp_fields.clear();
  params.wifi.access_points["near"].position = {0, 0};
  params.wifi.access_points["far"].position = {1e6, 0};
  const Recording run = simulate(params, 4);
  EXPECT_EQ(run.fields, (std::vector<std::string>{"far", "near"}));
  for (const FieldRow& row : run.measurements) {
    ASSERT_TRUE(std::isnan(row.values[0]));
    ASSERT_TRUE(std::isfinite(row.values[1]));
  }
}

TEST(Simulate, PurposesHaveTheirOwnRandomness) {
  WorldParams params = small_world();
  const Recording plain = simulate(params, 5);
  params.gp_fields["more"] = params.gp_fields["light"];
  params.sensor.rate = 2.0;
  const Recording changed = simulate(params, 5);
  for (std::size_t i = 0; i < plain.truth.size(); i += 100) {
    ASSERT_EQ(plain.truth[i].pose.vector(), changed.truth[i].pose.vector());
  }
}

TEST(Simulate, SurveyIsAGridOverTheArea) {
  const std::string csv = simulate_survey(small_world(), 6, 2.5);
  EXPECT_EQ(csv.substr(0, csv.find('\n')), "x_m,y_m,light");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 5 * 5);
  EXPECT_NE(csv.find("\n-2.5,5,"), std::string::npos);
}

TEST(Simulate, RobotsShareTheFieldAndNothingElse) {
  WorldParams world = small_world();
  world.duration = 300.0;
  world.robots["anna"].route.kind = RouteKind::random_waypoints;
  world.robots["bert"] = world.robots["anna"];
  world.robots["bert"].joins = 100.0;
  world.robots["bert"].leaves = 250.0;
  world.robots["bert"].position.rate = 1.0;
  world.robots["bert"].position.stddev = 2.0;
  const auto robots = simulate_all(world, 6);
  ASSERT_EQ(2u, robots.size());
  EXPECT_EQ("anna", robots[0].robot);
  EXPECT_TRUE(robots[0].positions.empty());
  EXPECT_EQ(std::chrono::seconds(1100), robots[1].truth.front().stamp);
  EXPECT_EQ(std::chrono::seconds(1250), robots[1].truth.back().stamp);
  EXPECT_EQ(std::chrono::seconds(1250), robots[1].measurements.back().stamp);
  EXPECT_GT(
      (robots[0].truth[50].pose.translation() - robots[1].truth[50].pose.translation()).norm(),
      1e-3)
      << "routes are drawn for each";
  const World field(world, 6);
  for (const Recording& robot : robots) {
    double sum = 0.0;
    for (const FieldRow& row : robot.measurements) {
      const auto pose = field_core::pose_at(robot.truth, row.stamp);
      ASSERT_TRUE(pose);
      sum += std::pow(row.values[0] - field.values(*pose)[0], 2);
    }
    // 151 and 301 readings with variance 0.25: 5 standard deviations of the sample's variance.
    EXPECT_NEAR(sum / static_cast<double>(robot.measurements.size()), 0.25, 0.15) << robot.robot;
  }
  ASSERT_EQ(151u, robots[1].positions.size());
  double squares = 0.0;
  for (const PositionRow& row : robots[1].positions) {
    EXPECT_EQ(4.0, row.variance);
    squares += (row.position - field_core::pose_at(robots[1].truth, row.stamp)->translation())
                   .squaredNorm();
  }
  EXPECT_NEAR(squares / 302.0, 4.0, 5.0 * 4.0 * std::sqrt(2.0 / 302.0));
}

}  // namespace
}  // namespace field_bags
