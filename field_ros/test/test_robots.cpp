// Several robots in one session: whose step is next, who is waited for, what belongs to whom.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "field_ros/robot_interface.hpp"
#include "test_support.hpp"
#include "toy_fleet.hpp"

namespace {

using namespace field_ros;
using field_ros_test::error_of;
using field_ros_test::make_fleet;
using field_ros_test::ToyFleet;
using Log = std::vector<std::pair<int, double>>;

nav_msgs::Odometry odometry(const std::string& robot, double stamp_s, double x) {
  auto message = field_ros_test::odometry(stamp_s, x);
  message.header.frame_id = robot + "/odom";
  message.child_frame_id = robot + "/base_link";
  return message;
}

field_msgs::FieldMeasurement measurement(const std::string& robot, double stamp_s,
                                         double value = 1.0) {
  auto message = field_ros_test::measurement(stamp_s, value);
  message.header.frame_id = robot + "/base_link";
  return message;
}

geometry_msgs::PoseWithCovarianceStamped position(double stamp_s, double x, double variance) {
  geometry_msgs::PoseWithCovarianceStamped message;
  message.header.stamp = ros::Time(stamp_s);
  message.header.frame_id = "map";
  message.pose.pose.position.x = x;
  message.pose.covariance[0] = message.pose.covariance[7] = variance;
  return message;
}

TEST(Robots, StepsComeInOrderOfTheirStamps) {
  Session s = make_fleet();
  s.on_odometry(odometry("anna", 1.0, 0.0), 0);
  s.on_odometry(odometry("bert", 1.0, 50.0), 1);
  s.on_field(measurement("anna", 1.3), 0);
  s.on_field(measurement("anna", 1.5), 0);
  s.on_odometry(odometry("anna", 1.4, 4.0), 0);
  EXPECT_TRUE(ToyFleet::log_.empty()) << "bert may have measured before 1.3";
  s.on_field(measurement("bert", 1.2), 1);
  s.on_odometry(odometry("bert", 1.4, 52.0), 1);
  EXPECT_EQ((Log{{1, 1.2}, {0, 1.3}}), ToyFleet::log_);
  s.on_odometry(odometry("bert", 1.6, 53.0), 1);
  s.on_odometry(odometry("anna", 1.6, 6.0), 0);
  EXPECT_EQ((Log{{1, 1.2}, {0, 1.3}, {0, 1.5}}), ToyFleet::log_);
  EXPECT_NEAR(5.0, s.belief(0).mean.x(), 1e-9);
  EXPECT_NEAR(1.0, s.belief(1).mean.x(), 1e-9);  // from 1.0 to 1.2 of bert's odometry
  EXPECT_NEAR(-50.0, s.map_to_odom(1)->x(), 1e-9);
  EXPECT_EQ(2u, s.counts(0).applied);
  EXPECT_EQ(1u, s.counts(1).applied);
  EXPECT_EQ(3u, s.total().applied);
}

TEST(Robots, ASilentRobotIsNotWaitedForAndMayComeBack) {
  Session s = make_fleet("robot_patience: 0.5\n");
  for (const double t : {1.0, 1.2}) {
    s.on_odometry(odometry("anna", t, t), 0);
    s.on_odometry(odometry("bert", t, -t), 1);
  }
  s.on_field(measurement("anna", 1.4), 0);
  s.on_odometry(odometry("anna", 1.5, 1.5), 0);
  EXPECT_TRUE(ToyFleet::log_.empty());
  s.on_odometry(odometry("anna", 1.75, 1.75), 0);
  EXPECT_EQ((Log{{0, 1.4}}), ToyFleet::log_) << "bert is 0.55 s behind: silent";
  for (double t = 2.0; t < 8.0; t += 1.0) s.on_odometry(odometry("anna", t, t), 0);
  // Back again: its motion while it was silent is one increment.
  s.on_field(measurement("bert", 7.0), 1);
  s.on_odometry(odometry("bert", 7.0, -7.0), 1);
  EXPECT_EQ((Log{{0, 1.4}, {1, 7.0}}), ToyFleet::log_);
  EXPECT_NEAR(-6.0, s.belief(1).mean.x(), 1e-9);
}

TEST(Robots, OneThatHasNotJoinedIsNotWaitedFor) {
  Session s = make_fleet();
  s.on_odometry(odometry("bert", 1.0, 0.0), 1);
  s.on_field(measurement("bert", 1.5), 1);
  s.on_odometry(odometry("bert", 2.0, 1.0), 1);
  EXPECT_EQ((Log{{1, 1.5}}), ToyFleet::log_);
  EXPECT_FALSE(s.map_to_odom(0));
}

TEST(Robots, ReorderWindowHoldsAcrossRobots) {
  Session s = make_fleet("reorder_window: 0.2\n");
  s.on_odometry(odometry("anna", 1.0, 0.0), 0);
  s.on_odometry(odometry("bert", 1.0, 0.0), 1);
  s.on_field(measurement("anna", 1.1), 0);
  s.on_odometry(odometry("anna", 1.3, 0.0), 0);
  s.on_odometry(odometry("bert", 1.2, 0.0), 1);
  s.on_field(measurement("bert", 1.05), 1);  // comes after its own odometry
  EXPECT_TRUE(ToyFleet::log_.empty());
  s.on_odometry(odometry("bert", 1.3, 0.0), 1);
  EXPECT_EQ((Log{{1, 1.05}, {0, 1.1}}), ToyFleet::log_);
}

/// The steps of two robots whose messages come up to `late` seconds after their stamps.
Log steps_of(double late, unsigned seed, bool deferred) {
  struct Message {
    double arrival, stamp;
    int robot;
    bool field;
  };
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> delay(0.0, late);
  std::vector<Message> messages;
  for (int robot = 0; robot < 2; ++robot) {
    double newest[2] = {0.0, 0.0};  // a topic keeps its order
    for (int tick = 0; tick < 400; ++tick) {
      const double stamp = 10.0 + 0.1 * tick;
      const bool away = robot == 1 && (tick < 50 || (tick > 150 && tick < 220) || tick > 330);
      for (const bool field : {false, true}) {
        if (away || (field && tick % 7 != robot)) continue;
        newest[field] = std::max(newest[field], stamp + delay(random));
        messages.push_back({newest[field], stamp, robot, field});
      }
    }
  }
  std::stable_sort(messages.begin(), messages.end(),
                   [](const Message& a, const Message& b) { return a.arrival < b.arrival; });
  Session s = make_fleet("reorder_window: 0.4\nrobot_patience: 1.0\n");
  if (deferred) s.defer_steps();
  const char* names[] = {"anna", "bert"};
  for (const Message& m : messages) {
    if (m.field) s.on_field(measurement(names[m.robot], m.stamp), m.robot);
    if (!m.field) s.on_odometry(odometry(names[m.robot], m.stamp, m.stamp), m.robot);
    while (deferred && random() % 3 > 0 && s.step_next()) {
    }
  }
  s.finish();
  return ToyFleet::log_;
}

TEST(Robots, LateMessagesAndASlowNodeGiveTheSameSteps) {
  const Log expected = steps_of(0.0, 1, false);
  EXPECT_GT(expected.size(), 80u);
  for (unsigned seed = 1; seed <= 20; ++seed) {
    EXPECT_EQ(expected, steps_of(0.3, seed, false)) << seed;
    EXPECT_EQ(expected, steps_of(0.3, seed, true)) << seed;
  }
  EXPECT_NE(expected, steps_of(3.0, 1, false)) << "beyond the window";
}

TEST(Robots, AtTheEndAllIsProcessedInOrder) {
  Session s = make_fleet();
  for (const char* robot : {"anna", "bert"}) {
    const int index = robot[0] == 'b';
    s.on_odometry(odometry(robot, 1.0, 0.0), index);
    s.on_field(measurement(robot, 1.4 - 0.2 * index), index);
    s.on_field(measurement(robot, 3.0), index);
  }
  s.on_odometry(odometry("anna", 1.45, 0.0), 0);
  s.on_odometry(odometry("bert", 1.25, 0.0), 1);
  EXPECT_EQ((Log{{1, 1.2}}), ToyFleet::log_);
  EXPECT_EQ(2u, s.finish());
  EXPECT_EQ((Log{{1, 1.2}, {0, 1.4}}), ToyFleet::log_);
}

TEST(Robots, ObservationsOfThePositionTakeTheirPlaceInTime) {
  Session s = make_fleet();
  s.on_odometry(odometry("bert", 1.0, 0.0), 1);
  s.on_field(measurement("bert", 1.4), 1);
  s.on_position(position(1.2, 10.0, 0.0), 1);
  s.on_odometry(odometry("bert", 2.0, 1.0), 1);
  EXPECT_EQ((Log{{1, 1.2}, {1, 1.4}}), ToyFleet::log_);
  EXPECT_NEAR(10.2, s.belief(1).mean.x(), 1e-9);
  EXPECT_EQ(2u, s.counts(1).measurements);
  EXPECT_EQ(2u, s.counts(1).applied);
}

TEST(Robots, BadObservationsOfThePositionAreDropped) {
  Session s = make_fleet();
  s.on_odometry(odometry("anna", 1.0, 0.0), 0);
  s.on_odometry(odometry("anna", 2.0, 0.0), 0);
  s.on_position(position(1.5, std::nan(""), 1.0), 0);
  s.on_position(position(1.5, 1.0, -1.0), 0);
  s.on_position(position(1.5, 1.0, INFINITY), 0);
  auto thin = position(1.5, 1.0, 1.0);
  thin.pose.covariance[1] = thin.pose.covariance[6] = 1.0;
  s.on_position(thin, 0);
  auto skew = position(1.5, 1.0, 1.0);
  skew.pose.covariance[1] = 0.5;
  s.on_position(skew, 0);
  auto elsewhere = position(1.5, 1.0, 1.0);
  elsewhere.header.frame_id = "utm";
  s.on_position(elsewhere, 0);
  s.on_position(position(0.0, 1.0, 1.0), 0);
  EXPECT_EQ(
      (Counts{
          {"non_finite_pose", 1}, {"bad_covariance", 4}, {"unknown_frame", 1}, {"zero_stamp", 1}}),
      s.counts(0).dropped);
  EXPECT_TRUE(ToyFleet::log_.empty());
}

TEST(Robots, EachHasItsOwnFramesAndSensors) {
  Session s = make_fleet();
  s.on_odometry(field_ros_test::odometry(1.0, 0.0), 0);
  EXPECT_EQ((Counts{{"unknown_frame", 1}}), s.counts(0).dropped);
  s.on_odometry(odometry("bert", 1.0, 0.0), 1);
  auto message = measurement("bert", 1.0);
  message.header.frame_id = "bert/base_link_mast";
  s.on_field(message, 1);
  EXPECT_NEAR(2.0, field_ros_test::ToyEstimator::last_place_.y(), 1e-12);
  message.header.frame_id = "anna/base_link_mast";
  s.on_field(message, 1);
  EXPECT_EQ(1u, s.waiting_for_transform(1)) << "bert's tf does not know anna's mast";
}

TEST(Robots, AClockSetBackStartsAllAgainOnce) {
  Session s = make_fleet();
  for (const double t : {100.0, 101.0}) {
    s.on_odometry(odometry("anna", t, t), 0);
    s.on_odometry(odometry("bert", t, t), 1);
  }
  s.on_odometry(odometry("anna", 1.0, 0.0), 0);
  s.on_odometry(odometry("bert", 101.1, 0.0), 1);
  s.on_odometry(odometry("anna", 1.1, 0.0), 0);
  EXPECT_EQ(1, ToyFleet::resets_);
  EXPECT_TRUE(s.map_to_odom(0));
  EXPECT_FALSE(s.map_to_odom(1));
  s.on_odometry(odometry("bert", 101.2, 0.0), 1);  // one that was under way
  s.on_odometry(odometry("bert", 1.1, 0.0), 1);
  s.on_odometry(odometry("bert", 1.2, 0.0), 1);
  EXPECT_EQ(1, ToyFleet::resets_) << "what anna has learned since stays";
  EXPECT_NEAR(1.2, field_core::to_seconds(s.newest_odometry(1)->stamp), 1e-6);
}

TEST(Robots, ScatterAndInitialPoseAreOneRobots) {
  Session s = make_fleet();
  s.on_odometry(odometry("anna", 1.0, 0.0), 0);
  s.on_odometry(odometry("bert", 1.0, 0.0), 1);
  s.scatter(1);
  EXPECT_EQ(100.0, s.belief(1).covariance(0, 0));
  EXPECT_EQ(1.0, s.belief(0).covariance(0, 0));
  auto guess = position(1.0, 7.0, 0.1);
  guess.pose.pose.orientation.w = 1.0;
  EXPECT_TRUE(s.on_initialpose(guess, 0));
  EXPECT_EQ(7.0, s.belief(0).mean.x());
  EXPECT_EQ(0.0, s.belief(1).mean.x());
}

TEST(RobotInterfaces, OneRobotHasThePlainNames) {
  NodeParams params;
  for (const char* name : {"", "robot1"}) {
    const auto robots = robot_interfaces(params, {name});
    ASSERT_EQ(1u, robots.size());
    EXPECT_EQ("", robots[0].prefix);
    EXPECT_EQ("odom", robots[0].odom);
    EXPECT_EQ("field", robots[0].field);
    EXPECT_EQ("odom", robots[0].odom_frame_id);
    EXPECT_EQ("base_link", robots[0].base_frame_id);
  }
}

TEST(RobotInterfaces, SeveralHaveNamespacesThatCanBeChanged) {
  NodeParams params;
  params.sensors["t"] = {SensorType::temperature, "thermometer", "air", {}};
  RobotParams bert;
  bert.name_space = "b";
  bert.odom = "/wheels";
  bert.base_frame_id = "chassis";
  bert.sensors["l"] = {SensorType::illuminance, "lux", "light", {}};
  params.robot_interfaces["bert"] = bert;
  const auto robots = robot_interfaces(params, {"anna", "bert"});
  EXPECT_EQ("anna/", robots[0].prefix);
  EXPECT_EQ("anna/odom", robots[0].odom);
  EXPECT_EQ("anna/position", robots[0].position);
  EXPECT_EQ("anna/odom", robots[0].odom_frame_id);
  EXPECT_EQ("anna/thermometer", robots[0].sensors.at(0).topic);
  EXPECT_EQ("bert/", robots[1].prefix);
  EXPECT_EQ("/wheels", robots[1].odom);
  EXPECT_EQ("b/field", robots[1].field);
  EXPECT_EQ("b/odom", robots[1].odom_frame_id);
  EXPECT_EQ("chassis", robots[1].base_frame_id);
  ASSERT_EQ(1u, robots[1].sensors.size());
  EXPECT_EQ("b/lux", robots[1].sensors[0].topic);
}

TEST(RobotInterfaces, RefuseWhatWouldMixRobots) {
  const auto refusal = [](const std::string& extra) {
    return error_of([&] { make_fleet(extra); });
  };
  const auto expect = [&](const std::string& extra, const std::string& part) {
    const std::string text = refusal(extra);
    EXPECT_NE(std::string::npos, text.find(part)) << text;
  };
  expect("robot_interfaces: {carl: {odom: wheels}}\n", "is none of the robots");
  expect("robot_interfaces: {anna: {field: /air}, bert: {field: /air}}\n",
         "shares the topic '/air'");
  expect("robot_interfaces: {anna: {odom_frame_id: bert/odom}}\n", "shares the odom_frame_id");
  expect("sensors: {t: {type: temperature, topic: /t, field: light}}\n", "shares the topic '/t'");
  expect("robots: [anna, 'b ert']\n", "letters, digits and '_'");
  expect("robot_interfaces: {anna: {odom: ''}}\n", "empty topic");
}

}  // namespace
