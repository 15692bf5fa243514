// One robot's part of a session: its messages until they are steps, and what is known of it.
#pragma once

#include <field_msgs/FieldMeasurement.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <nav_msgs/Odometry.h>

#include <optional>
#include <string>

#include "field_core/estimator.hpp"
#include "field_ros/drop_reason.hpp"
#include "field_ros/lost_monitor.hpp"
#include "field_ros/message_check.hpp"
#include "field_ros/placement_queue.hpp"
#include "field_ros/robot_interface.hpp"
#include "field_ros/stream_merge.hpp"

namespace field_ros {

/// What happened so far; the numbers of /diagnostics and of summary.json.
struct SessionCounts {
  std::uint64_t odometry = 0;      ///< messages received
  std::uint64_t measurements = 0;  ///< messages received, observations of the position among them
  std::uint64_t steps = 0;         ///< samples given to the estimator
  std::uint64_t applied = 0;
  std::uint64_t lost = 0;  ///< steps after which health() says so
  std::uint64_t numerical_errors = 0;
  std::uint64_t clock_resets = 0;
  std::uint64_t recoveries = 0;      ///< global localizations because the robot was lost
  std::uint64_t unknown_fields = 0;  ///< names that are not configured, in messages that were used
  Counts skipped;                    ///< by the estimator's reason
  Counts noted;                      ///< applied, but odd: by the estimator's reason
  Counts dropped;                    ///< by drop_name()
  double nis_sum = 0.0;              ///< over applied samples that make a statement
  std::uint64_t nis_dof_sum = 0;

  SessionCounts& operator+=(const SessionCounts& other);
};

class RobotStream {
 public:
  /// @param placement of a sensor's frame in this robot's base
  RobotStream(RobotInterface interface, const NodeParams& params, SensorPlacement placement);
  RobotStream(const RobotStream&) = delete;
  RobotStream& operator=(const RobotStream&) = delete;

  const RobotInterface& interface() const { return interface_; }

  /// The message as a value; nullopt if it is dropped (and counted).
  std::optional<OdometrySample> check(const nav_msgs::Odometry& message);
  void on_field(const field_msgs::FieldMeasurement& message, const FieldIndex& fields, bool paused);
  void on_position(const geometry_msgs::PoseWithCovarianceStamped& message, bool paused);
  /// Measurements whose sensor tf has placed go into the merge. @param end nothing will follow
  void take_placed(bool end = false);

  std::optional<field_core::Stamp> newest_odometry() const;
  void drop(DropReason reason) { ++counts.dropped[drop_name(reason)]; }
  /// The pose is another one: the last innovations say nothing about it.
  void forget_verdict();
  /// As before the first message; the counts go on.
  void forget();
  /// Takes the estimator's belief, as of this stamp.
  void set_belief(field_core::Belief belief, field_core::Stamp stamp);

  StreamMerge merge;
  PlacementQueue placement;
  LostMonitor monitor;
  SessionCounts counts;
  field_core::Belief belief;
  std::optional<field_core::SE2> map_to_odom;  ///< nullopt before the first odometry
  std::string last_error;
  bool lost = false;

 private:
  /// 0 is a time like any other at the start of a recording or of simulated time, not later.
  bool unstamped(field_core::Stamp stamp) const;

  RobotInterface interface_;
  std::string global_frame_;
  std::size_t max_fields_;
  bool use_sensor_frames_;
};

}  // namespace field_ros
