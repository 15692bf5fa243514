#include "live_robot.hpp"

#include <ros/ros.h>

#include <algorithm>
#include <utility>

#include "field_ros/sensors.hpp"

namespace field_ros {
namespace {

double steady_now() { return ros::SteadyTime::now().toSec(); }

}  // namespace

LiveRobot::LiveRobot(ros::NodeHandle& handle, ros::NodeHandle& private_handle, Session& session,
                     const StateKeeper& keeper, int robot, std::function<void()> on_clock_reset)
    : session_(session),
      keeper_(keeper),
      robot_(robot),
      status_name_(ros::this_node::getName().substr(1)),
      on_clock_reset_(std::move(on_clock_reset)),
      publishers_(private_handle, session, robot) {
  if (session.robots() > 1) status_name_ += "/" + session.interface(robot).name;
  last_odometry_ = last_measurement_ = last_step_ = steady_now();
  before_ = snapshot();
  subscribe(handle);
}

void LiveRobot::subscribe(ros::NodeHandle& handle) {
  const RobotInterface& topics = session_.interface(robot_);
  const auto odom_queue = static_cast<std::uint32_t>(session_.params().odom_queue_size);
  const auto field_queue = static_cast<std::uint32_t>(session_.params().field_queue_size);
  subscribers_ = {
      handle.subscribe(topics.odom, odom_queue, &LiveRobot::on_odometry, this),
      handle.subscribe(topics.field, field_queue, &LiveRobot::on_field, this),
      handle.subscribe(topics.initialpose, 2, &LiveRobot::on_initialpose, this),
  };
  if (session_.estimator().uses_positions()) {
    subscribers_.push_back(
        handle.subscribe(topics.position, field_queue, &LiveRobot::on_position, this));
  }
  for (const SensorParams& sensor : topics.sensors) {
    with_sensor_message(sensor.type, [&](auto* type) {
      using Message = std::remove_pointer_t<decltype(type)>;
      const boost::function<void(const boost::shared_ptr<const Message>&)> callback =
          [this, sensor](const boost::shared_ptr<const Message>& message) {
            on_field(to_field(*message, sensor));
          };
      subscribers_.push_back(handle.subscribe<Message>(sensor.topic, field_queue, callback));
    });
  }
}

void LiveRobot::on_field(const field_msgs::FieldMeasurement& message) {
  last_measurement_ = steady_now();
  session_.on_field(message, robot_);
}

void LiveRobot::on_position(const geometry_msgs::PoseWithCovarianceStamped& message) {
  last_measurement_ = steady_now();
  session_.on_position(message, robot_);
}

void LiveRobot::on_odometry(const nav_msgs::Odometry& message) {
  last_odometry_ = steady_now();
  const std::uint64_t resets = session_.counts(robot_).clock_resets;
  session_.on_odometry(message, robot_);
  if (session_.counts(robot_).clock_resets > resets) on_clock_reset_();
  publishers_.publish_transform();
}

void LiveRobot::on_initialpose(const geometry_msgs::PoseWithCovarianceStamped& message) {
  if (session_.on_initialpose(message, robot_)) on_replaced();
}

void LiveRobot::on_step(const SessionStep& step) {
  last_step_ = steady_now();
  step_time_sum_ += step.step_s;
  step_time_max_ = std::max(step_time_max_, step.step_s);
  publishers_.publish_belief();
}

void LiveRobot::on_replaced() {
  publishers_.clear_path();
  publishers_.publish_belief();
  publishers_.publish_transform();
}

HealthSnapshot LiveRobot::snapshot() const {
  HealthSnapshot now;
  now.time_s = steady_now();
  now.counts = session_.counts(robot_);
  now.step_time_sum_s = step_time_sum_;
  now.step_time_max_s = step_time_max_;
  now.since_odometry_s = now.time_s - last_odometry_;
  now.since_measurement_s = now.time_s - last_measurement_;
  now.since_step_s = now.time_s - last_step_;
  now.input_timeout_s = session_.params().input_timeout;
  now.health = session_.health(robot_);
  now.recent_nis = session_.recent_nis(robot_);
  now.waiting_for_transform = session_.waiting_for_transform(robot_);
  now.states_saved = keeper_.saved();
  now.save_problem = keeper_.problem();
  now.belief = session_.belief(robot_);
  now.pending = session_.pending(robot_);
  now.paused = session_.paused();
  now.last_error = session_.last_error(robot_);
  return now;
}

void LiveRobot::report(diagnostic_msgs::DiagnosticArray& message) {
  HealthSnapshot now = snapshot();
  for (auto& status : diagnose(status_name_, before_, now).status) {
    message.status.push_back(std::move(status));
  }
  before_ = std::move(now);
  step_time_max_ = 0.0;
}

}  // namespace field_ros
