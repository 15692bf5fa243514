// One robot of a live node: its subscriptions, what is published for it, its diagnostics.
#pragma once

#include <diagnostic_msgs/DiagnosticArray.h>
#include <ros/node_handle.h>

#include <functional>
#include <string>
#include <vector>

#include "field_ros/diagnostics.hpp"
#include "field_ros/publishers.hpp"
#include "field_ros/session.hpp"
#include "field_ros/state_keeper.hpp"

namespace field_ros {

class LiveRobot {
 public:
  /// @param on_clock_reset called when this robot's odometry has restarted the session
  LiveRobot(ros::NodeHandle& handle, ros::NodeHandle& private_handle, Session& session,
            const StateKeeper& keeper, int robot, std::function<void()> on_clock_reset);
  LiveRobot(const LiveRobot&) = delete;
  LiveRobot& operator=(const LiveRobot&) = delete;

  void on_step(const SessionStep& step);
  /// The pose or the map has been replaced from outside.
  void on_replaced();
  void clear_path() { publishers_.clear_path(); }
  /// Adds this robot's statuses, about the time since the report before.
  void report(diagnostic_msgs::DiagnosticArray& message);

 private:
  void subscribe(ros::NodeHandle& handle);
  void on_field(const field_msgs::FieldMeasurement& message);
  void on_odometry(const nav_msgs::Odometry& message);
  void on_position(const geometry_msgs::PoseWithCovarianceStamped& message);
  void on_initialpose(const geometry_msgs::PoseWithCovarianceStamped& message);
  HealthSnapshot snapshot() const;

  Session& session_;
  const StateKeeper& keeper_;
  int robot_;
  std::string status_name_;
  std::function<void()> on_clock_reset_;
  RobotPublishers publishers_;
  std::vector<ros::Subscriber> subscribers_;
  HealthSnapshot before_;
  double step_time_sum_ = 0.0, step_time_max_ = 0.0;
  double last_odometry_ = 0.0, last_measurement_ = 0.0, last_step_ = 0.0;  // steady clock [s]
};

}  // namespace field_ros
