// Checks of messages, and round trips of every conversion.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "field_ros/message_check.hpp"
#include "field_ros/publishers.hpp"
#include "field_ros/sensors.hpp"
#include "test_support.hpp"

namespace {

using namespace field_ros;
using field_core::SE2;
using field_ros_test::error_of;
using field_ros_test::measurement;
using field_ros_test::odometry;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
const FieldIndex kFields = {{"light", 0}, {"wifi", 1}};

DropReason odometry_reason(const nav_msgs::Odometry& m) {
  return check_odometry(m, "odom", "base_link").reason;
}
DropReason field_reason(const field_msgs::FieldMeasurement& m) {
  return check_field(m, kFields, 100).reason;
}

TEST(MessageCheck, GoodOdometryIsTaken) {
  auto m = odometry(1.5, 2.0, -1.0, 0.5);
  m.header.frame_id = "/odom";  // tf of old
  const auto checked = check_odometry(m, "odom", "base_link");
  ASSERT_TRUE(checked);
  EXPECT_EQ(1500000000, checked.value->stamp.count());
  EXPECT_NEAR(0.5, checked.value->pose.yaw(), 1e-15);
  m.header.frame_id = m.child_frame_id = "";
  EXPECT_EQ(DropReason::none, odometry_reason(m));
}

TEST(MessageCheck, BadOdometryIsNamed) {
  auto m = odometry(1, 0);
  m.pose.pose.position.x = kNan;
  EXPECT_EQ(DropReason::non_finite_pose, odometry_reason(m));
  m = odometry(1, 0);
  m.pose.pose.orientation.w = kInfinity;
  EXPECT_EQ(DropReason::non_finite_pose, odometry_reason(m));
  m = odometry(1, 0);
  m.pose.pose.orientation.w = 0.0;  // all zero: a forgotten orientation
  EXPECT_EQ(DropReason::bad_quaternion, odometry_reason(m));
  m = odometry(1, 0);
  m.header.frame_id = "mars";
  EXPECT_EQ(DropReason::unknown_frame, odometry_reason(m));
  m = odometry(1, 0);
  m.child_frame_id = "gripper";
  EXPECT_EQ(DropReason::unknown_frame, odometry_reason(m));
  m = odometry(1, 0);
  m.pose.covariance[7] = -1.0;
  EXPECT_EQ(DropReason::bad_covariance, odometry_reason(m));
}

TEST(MessageCheck, GoodMeasurementsKeepWhatIsKnownAndObserved) {
  auto m = measurement(2, 7.0);
  m.names = {"wifi", "smell", "light"};
  m.values = {-50.0, 1.0, kNan};
  m.variances = {4.0, 0.0, 0.0};
  const auto checked = check_field(m, kFields, 3);
  ASSERT_TRUE(checked);
  ASSERT_EQ(1u, checked.value->readings.size());
  EXPECT_EQ(1, checked.value->readings[0].field);
  EXPECT_EQ(-50.0, checked.value->readings[0].value);
  EXPECT_EQ(4.0, checked.value->readings[0].variance);
  EXPECT_EQ(1, checked.value->unknown_fields);
}

TEST(MessageCheck, BadMeasurementsAreNamed) {
  auto m = measurement(2, 7.0);
  m.names.clear(), m.values.clear();
  EXPECT_EQ(DropReason::empty_measurement, field_reason(m));
  m = measurement(2, 7.0);
  m.values.push_back(1.0);
  EXPECT_EQ(DropReason::length_mismatch, field_reason(m));
  m = measurement(2, 7.0);
  m.variances = {1.0, 1.0};
  EXPECT_EQ(DropReason::length_mismatch, field_reason(m));
  m.variances = {-1.0};
  EXPECT_EQ(DropReason::negative_variance, field_reason(m));
  m.variances = {kNan};
  EXPECT_EQ(DropReason::negative_variance, field_reason(m));
  EXPECT_EQ(DropReason::infinite_value, field_reason(measurement(2, -kInfinity)));
  EXPECT_EQ(DropReason::nothing_observed, field_reason(measurement(2, kNan)));
  EXPECT_EQ(DropReason::no_known_field, field_reason(measurement(2, 1.0, "smell")));
  m = measurement(2, 7.0);
  m.names = {"light", "light"};
  m.values = {1.0, 2.0};
  EXPECT_EQ(DropReason::duplicate_field, field_reason(m));
  m.names.assign(1000000, "light");
  m.values.assign(1000000, 1.0);
  EXPECT_EQ(DropReason::too_many_fields, field_reason(m));
}

TEST(MessageCheck, InitialPose) {
  geometry_msgs::PoseWithCovarianceStamped m;
  m.header.frame_id = "map";
  m.pose.pose = to_pose({1.0, 2.0, 3.0});
  const auto zero = check_initialpose(m, "map");
  ASSERT_TRUE(zero);
  EXPECT_EQ(field_core::kMinimumPoseVariance, zero.value->covariance(2, 2));
  m.pose.covariance[0] = 1.0, m.pose.covariance[1] = 0.5;
  EXPECT_EQ(DropReason::bad_covariance, check_initialpose(m, "map").reason);  // not symmetric
  m.pose.covariance[6] = 0.5;
  EXPECT_EQ(DropReason::bad_covariance, check_initialpose(m, "map").reason);  // indefinite
  m.pose.covariance[7] = 1.0;
  EXPECT_EQ(DropReason::none, check_initialpose(m, "map").reason);
  m.pose.covariance[35] = kNan;
  EXPECT_EQ(DropReason::bad_covariance, check_initialpose(m, "map").reason);
  EXPECT_EQ(DropReason::unknown_frame, check_initialpose(m, "world").reason);
}

TEST(MessageCheck, EveryReasonHasItsOwnNameAndText) {
  std::set<std::string> names, texts;
  const int count = static_cast<int>(DropReason::numerical_error) + 1;
  for (int i = 0; i < count; ++i) {
    names.insert(drop_name(static_cast<DropReason>(i)));
    texts.insert(drop_text(static_cast<DropReason>(i)));
  }
  EXPECT_EQ(count, static_cast<int>(names.size()));
  EXPECT_EQ(count, static_cast<int>(texts.size()));
}

TEST(Convert, RoundTrips) {
  for (const double yaw : {-3.1, -M_PI / 2, 0.0, 1e-9, 2.5, M_PI}) {
    const SE2 pose(1.25, -3.5, yaw);
    EXPECT_NEAR(yaw, from_pose(to_pose(pose)).yaw(), 1e-15 * 8);  // a few roundings of pi
    EXPECT_EQ(pose.translation(), from_pose(to_pose(pose)).translation());
    EXPECT_EQ(from_pose(to_pose(pose)).vector(), from_transform(to_transform(pose)).vector());
  }
  for (const std::int64_t ns : {0LL, 1LL, 1400000000123456789LL, 4294967295999999999LL}) {
    EXPECT_EQ(ns, from_ros(to_ros(field_core::Stamp(ns))).count());
  }
  EXPECT_TRUE(to_ros(field_core::Stamp(-5)).isZero());
  const Eigen::Matrix3d covariance = (Eigen::Matrix3d() << 1, 2, 3, 2, 5, 6, 3, 6, 9).finished();
  geometry_msgs::PoseWithCovariance ros;
  set_covariance(covariance, ros.covariance);
  EXPECT_EQ(covariance, get_covariance(ros.covariance));
  EXPECT_EQ(3.0, ros.covariance[5]);   // x, yaw
  EXPECT_EQ(9.0, ros.covariance[35]);  // yaw, yaw
}

TEST(Convert, HyperparametersComeVectorAfterVector) {
  field_core::HyperparameterPosterior posterior;
  posterior.field = "light";
  posterior.names = {"kappa", "alpha"};
  posterior.values.resize(2, 3);
  posterior.values << 1.0, 2.0, 3.0, 0.1, 0.2, 0.3;
  posterior.probability = Eigen::Vector3d(0.5, 0.3, 0.2);
  const auto message = field_ros::to_message(posterior);
  EXPECT_EQ("light", message.field);
  EXPECT_EQ((std::vector<std::string>{"kappa", "alpha"}), message.names);
  EXPECT_EQ((std::vector<double>{1.0, 0.1, 2.0, 0.2, 3.0, 0.3}), message.values);
  EXPECT_EQ((std::vector<double>{0.5, 0.3, 0.2}), message.probability);
}

TEST(Convert, YawOfATiltedRobotIsItsHeading) {
  // Rotation by 0.3 about y then 1.0 about z: q = qz * qy, multiplied out by hand.
  geometry_msgs::Pose pose;
  pose.orientation.w = std::cos(0.5) * std::cos(0.15);
  pose.orientation.x = -std::sin(0.5) * std::sin(0.15);
  pose.orientation.y = std::cos(0.5) * std::sin(0.15);
  pose.orientation.z = std::sin(0.5) * std::cos(0.15);
  EXPECT_NEAR(1.0, from_pose(pose).yaw(), 1e-15 * 8);
}

TEST(Convert, StateRoundTripIsBitForBitAndDamageIsRefused) {
  field_core::State state("toy", 3);
  Eigen::MatrixXd block(2, 3);
  block << 1.0 / 3.0, 2, 3, 4, 5, 1e-300;
  state.set("block", block);
  state.set("empty", Eigen::MatrixXd(0, 4));
  state.set_text("random", "state of\na generator");
  auto message = to_message(state);
  const field_core::State back = from_message(message);
  EXPECT_EQ("toy", back.estimator());
  EXPECT_EQ(3u, back.version());
  EXPECT_EQ(block, back.matrix("block", 2, 3));
  EXPECT_EQ(4, back.matrix("empty").cols());
  EXPECT_EQ("state of\na generator", back.text("random"));
  message.blocks[0].data.pop_back();
  EXPECT_NE(std::string::npos, error_of([&] { from_message(message); }).find("'block'"));
  message.blocks[0] = message.blocks[1];
  EXPECT_NE(std::string::npos, error_of([&] { from_message(message); }).find("comes twice"));
}

SensorParams sensor(const char* field) {
  SensorParams out;
  out.field = field;
  return out;
}

TEST(Sensors, BecomeFields) {
  sensor_msgs::Temperature t;
  t.header.frame_id = "nose";
  t.temperature = 21.5;
  t.variance = 0.25;
  const auto m = to_field(t, sensor("warmth"));
  EXPECT_EQ("nose", m.header.frame_id);
  EXPECT_EQ("warmth", m.names.at(0));
  EXPECT_EQ(21.5, m.values.at(0));
  EXPECT_EQ(0.25, m.variances.at(0));
  sensor_msgs::Range r;
  r.min_range = 0.5F, r.max_range = 4.0F, r.range = 2.0F;
  EXPECT_EQ(2.0, to_field(r, sensor("r")).values.at(0));
  for (const float bad : {0.1F, 5.0F, std::numeric_limits<float>::infinity()}) {
    r.range = bad;
    EXPECT_TRUE(std::isnan(to_field(r, sensor("r")).values.at(0)));
  }
  sensor_msgs::MagneticField b;
  b.magnetic_field.x = 2.0, b.magnetic_field.y = 3.0, b.magnetic_field.z = 6.0;
  b.magnetic_field_covariance[4] = 0.5;
  EXPECT_EQ((std::vector<double>{2.0, 3.0, 6.0, 7.0}), to_field(b, sensor("mag")).values);
  EXPECT_EQ(0.5, to_field(b, sensor("mag")).variances.at(1));
  b.magnetic_field_covariance[0] = -1.0;
  EXPECT_TRUE(to_field(b, sensor("mag")).variances.empty());
  EXPECT_STREQ("sensor_msgs/FluidPressure", sensor_datatype(SensorType::fluid_pressure));
}

TEST(Sensors, AMagnetometerIsCalibrated) {
  sensor_msgs::MagneticField b;
  b.magnetic_field.x = 5.0, b.magnetic_field.y = 3.0, b.magnetic_field.z = 2.0;
  b.magnetic_field_covariance[0] = 1.0, b.magnetic_field_covariance[4] = 4.0;
  b.magnetic_field_covariance[1] = b.magnetic_field_covariance[3] = 0.5;
  SensorParams mag = sensor("mag");
  mag.calibration.offset = {1.0, 2.0, 3.0};
  mag.calibration.matrix = {2.0, 1.0, 0.0, 1.0, 3.0, 0.0, 0.0, 0.0, 1.0};
  // By hand: M (4, 1, -1) = (9, 7, -1); diag(M C M') = (4 + 2 + 4, 1 + 3 + 36, 0).
  const auto m = to_field(b, mag);
  EXPECT_EQ((std::vector<double>{9.0, 7.0, -1.0, std::sqrt(131.0)}), m.values);
  EXPECT_EQ((std::vector<double>{10.0, 40.0, 0.0, 0.0}), m.variances);
}

}  // namespace
