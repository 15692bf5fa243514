// The one path from messages to the estimator, with an estimator that can be checked by hand.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "field_ros/map_messages.hpp"
#include "field_ros/services.hpp"
#include "field_ros/session.hpp"
#include "test_support.hpp"
#include "toy_estimator.hpp"
#include "toy_session.hpp"

namespace {

using namespace field_ros;
using field_core::SE2;
using field_ros_test::error_of;
using field_ros_test::make_session;
using field_ros_test::measurement;
using field_ros_test::odometry;
using field_ros_test::ToyEstimator;

TEST(Session, PosesAndFieldFollowTheMessages) {
  Session s = make_session();
  EXPECT_FALSE(s.map_to_odom());
  std::vector<double> stamps;
  s.set_listener([&stamps](const SessionStep& step) {
    stamps.push_back(field_core::to_seconds(step.belief.stamp));
  });
  s.on_odometry(odometry(1.0, 100.0));
  ASSERT_TRUE(s.map_to_odom());
  EXPECT_NEAR(-90.0, s.map_to_odom()->x(), 1e-12);
  s.on_field(measurement(1.5, 6.0));
  s.on_odometry(odometry(2.0, 102.0));
  EXPECT_EQ((std::vector<double>{1.5}), stamps);
  EXPECT_NEAR(11.0, s.belief().mean.x(), 1e-12);
  // Prior N(0, 4), noise 0.25: mean 6 * 4 / 4.25, NIS 36 / 4.25.
  const auto response = predict_field(s.estimator(), [] {
    field_msgs::PredictField::Request request;
    request.points.resize(2);
    return request;
  }());
  EXPECT_TRUE(response.success);
  ASSERT_EQ(2u, response.mean.size());
  EXPECT_NEAR(6.0 * 4.0 / 4.25, response.mean[1], 1e-12);
  EXPECT_NEAR(36.0 / 4.25, s.counts().nis_sum, 1e-12);
  EXPECT_EQ(1u, s.counts().nis_dof_sum);
}

TEST(Session, CountsWhatItCannotUseAndLivesOn) {
  Session s = make_session();
  s.on_odometry(odometry(1.0, 0.0));
  s.on_odometry(odometry(2.0, 1.0));
  s.on_field(measurement(1.1, 1.0, "smell"));
  s.on_field(measurement(1.1, 2000.0));
  s.on_field(measurement(1.2, -2000.0));
  auto bad = odometry(3.0, NAN);
  s.on_odometry(bad);
  geometry_msgs::PoseWithCovarianceStamped guess;
  s.on_initialpose(guess);  // no orientation
  s.on_field(measurement(1.3, 5.0));
  const SessionCounts& c = s.counts();
  EXPECT_EQ(3u, c.steps);
  EXPECT_EQ(1u, c.applied);
  EXPECT_EQ((Counts{{"too_bright", 1}}), c.skipped);
  EXPECT_EQ(1u, c.numerical_errors);
  EXPECT_EQ("the toy cannot go that dark", s.last_error());
  EXPECT_EQ((Counts{{"no_known_field", 1},
                    {"numerical_error", 1},
                    {"non_finite_pose", 1},
                    {"bad_quaternion", 1}}),
            c.dropped);
}

TEST(Session, SensorsStandWhereTfPutsThem) {
  Session s = make_session();
  s.on_odometry(odometry(1.0, 0.0));
  auto m = measurement(1.0, 1.0);
  m.header.frame_id = "/mast";
  s.on_field(m);
  EXPECT_NEAR(10.0, ToyEstimator::last_place_.x(), 1e-12);
  EXPECT_NEAR(2.0, ToyEstimator::last_place_.y(), 1e-12);
  m.header.frame_id = "nowhere";
  s.on_field(m);
  EXPECT_EQ(1u, s.waiting_for_transform());
  s.on_odometry(odometry(5.0, 0.0));
  s.on_odometry(odometry(11.0, 0.0));  // sensor_transform_timeout later
  EXPECT_EQ((Counts{{"unknown_frame", 1}}), s.counts().dropped);
  Session at_base = make_session("use_sensor_frames: false\n");
  at_base.on_odometry(odometry(1.0, 0.0));
  at_base.on_field(m);
  EXPECT_EQ(1u, at_base.counts().applied);
  EXPECT_EQ(0.0, ToyEstimator::last_place_.y());
}

TEST(Session, InitialPoseHoldsAtItsStamp) {
  Session s = make_session();
  s.on_odometry(odometry(1.0, 0.0));
  s.on_odometry(odometry(3.0, 4.0));
  geometry_msgs::PoseWithCovarianceStamped guess;
  guess.header.frame_id = "map";
  guess.header.stamp = ros::Time(2.0);
  guess.pose.pose = to_pose({-5.0, 0.0, 0.0});
  s.on_initialpose(guess);
  s.on_field(measurement(3.0, 1.0));
  EXPECT_NEAR(-3.0, s.belief().mean.x(), 1e-12);  // driven 2 m since the guess
  EXPECT_NEAR(-7.0, s.map_to_odom()->x(), 1e-12);
}

TEST(Session, ARestartedClockStartsAgain) {
  Session s = make_session();
  for (const double t : {100.0, 101.0}) s.on_odometry(odometry(t, t));
  s.on_field(measurement(101.0, 3.0));
  EXPECT_NEAR(11.0, s.belief().mean.x(), 1e-12);
  for (const double t : {1.0, 2.0}) s.on_odometry(odometry(t, 50.0));
  EXPECT_EQ(1u, s.counts().clock_resets);
  EXPECT_NEAR(10.0, s.belief().mean.x(), 1e-12);
  EXPECT_NEAR(-40.0, s.map_to_odom()->x(), 1e-12);
  s.on_field(measurement(2.0, 3.0));
  EXPECT_EQ(2u, s.counts().applied);
}

TEST(Session, WhilePausedTheMotionIsStillFollowed) {
  Session s = make_session();
  s.on_odometry(odometry(1.0, 0.0));
  s.set_paused(true);
  s.on_odometry(odometry(2.0, 5.0));
  s.on_field(measurement(2.0, 1.0));
  EXPECT_EQ((Counts{{"paused", 1}}), s.counts().dropped);
  s.set_paused(false);
  s.on_odometry(odometry(3.0, 7.0));
  s.on_field(measurement(3.0, 1.0));
  EXPECT_NEAR(17.0, s.belief().mean.x(), 1e-12);
}

TEST(Services, PredictFieldRefusesWithAReason) {
  const Session s = make_session();
  field_msgs::PredictField::Request request;
  request.points.resize(1);
  request.names = {"smell"};
  EXPECT_EQ("there is no field 'smell'; known: light",
            predict_field(s.estimator(), request).message);
  request.names.clear();
  request.points[0].x = NAN;
  const auto response = predict_field(s.estimator(), request);
  EXPECT_FALSE(response.success);
  EXPECT_TRUE(response.mean.empty());
}

TEST(Configured, RefusesIllegalFieldNamesAndGiantMaps) {
  EXPECT_NE(std::string::npos,
            error_of([] { make_session("field: \"a b\"\n"); }).find("fields/a b"));
  const std::string text = error_of([] { make_session("map_resolution: 0.0001\n"); });
  EXPECT_EQ(
      0u, text.find("toy.yaml:3: parameter 'map_resolution': 1e-04 m gives a map of 1.6e+09 cells"))
      << text;
}

TEST(Maps, UnknownCellsAreMinusOneAndTheRestFillsTheScale) {
  PredictedGrid map;
  map.grid = FieldGrid::cover({0.0, 0.0, 1.5, 0.5}, 0.5);
  ASSERT_EQ(3, map.grid.width);
  ASSERT_EQ(1, map.grid.height);
  EXPECT_NEAR(1.25, map.grid.centres()(0, 2), 1e-15);
  map.fields = {{"light", "lx"}};
  map.prediction.mean = Eigen::RowVector3d(-3.0, 5.0, 1.0);
  map.prediction.variance = Eigen::RowVector3d(1.0, 3.7, 4.0 * 0.25);
  map.prediction.prior_variance = Eigen::VectorXd::Constant(1, 4.0);
  const auto grid = to_occupancy_grid(map, 0, false);
  EXPECT_EQ((std::vector<std::int8_t>{0, -1, 100}), grid.data);
  EXPECT_EQ((std::vector<std::int8_t>{0, -1, 0}), to_occupancy_grid(map, 0, true).data);
  const auto field = to_field_map(map, 0);
  EXPECT_EQ((std::vector<float>{-3.0F, 5.0F, 1.0F}), field.mean);
  const auto cloud = to_point_cloud(map);
  EXPECT_EQ(5u, cloud.fields.size());
  EXPECT_EQ("light_stddev", cloud.fields[4].name);
  float value;
  std::memcpy(&value, &cloud.data[1 * cloud.point_step + 16], 4);
  EXPECT_FLOAT_EQ(std::sqrt(3.7F), value);
}

TEST(Maps, EllipseHasTheAxesOfTheCovariance) {
  field_core::Belief belief;
  belief.covariance = Eigen::Vector3d(1.0, 9.0, 0.1).asDiagonal();
  const auto ellipse = to_markers(belief, "map").markers.at(0);
  // 90 % of a plane Gaussian lies within sqrt(4.605170) standard deviations.
  EXPECT_NEAR(2.0 * 3.0 * std::sqrt(4.605170185988092), ellipse.scale.x, 1e-9);
  EXPECT_NEAR(2.0 * 1.0 * std::sqrt(4.605170185988092), ellipse.scale.y, 1e-9);
  EXPECT_NEAR(M_PI / 2, std::abs(from_pose(ellipse.pose).yaw()), 1e-9);
}

}  // namespace
