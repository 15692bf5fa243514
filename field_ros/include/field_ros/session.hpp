// The one path from messages to the estimator, walked alike by the live node and by the replay.
#pragma once

#include <field_msgs/EstimatorState.h>
#include <field_msgs/FieldMeasurement.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <nav_msgs/Odometry.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "field_ros/any_estimator.hpp"
#include "field_ros/drop_reason.hpp"
#include "field_ros/lost_monitor.hpp"
#include "field_ros/message_check.hpp"
#include "field_ros/placement_queue.hpp"
#include "field_ros/stream_merge.hpp"

namespace field_ros {

/// What happened so far; the numbers of /diagnostics and of summary.json.
struct SessionCounts {
  std::uint64_t odometry = 0;      ///< messages received
  std::uint64_t measurements = 0;  ///< messages received
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
};

/// One sample, processed.
struct SessionStep {
  const field_core::Belief& belief;
  const field_core::UpdateResult& result;
  field_core::SE2 odom_pose;
  double step_s;  ///< wall-clock time of predict and update
};

class Session {
 public:
  using Listener = std::function<void(const SessionStep&)>;

  Session(Configured configured, SensorPlacement placement);

  void set_listener(Listener listener) { listener_ = std::move(listener); }

  /// From now on messages only wait; the owner calls step_next(). A live node takes in all that has
  /// come before each step, so that under overload the oldest can be left out (max_pose_lag).
  void defer_steps() { deferred_ = true; }
  bool step_ready() const { return merge_.ready(); }
  /// One step, if one is ready; false if none was made.
  bool step_next();

  /// None of these throws because of a message: what cannot be used is dropped and counted.
  void on_odometry(const nav_msgs::Odometry& message);
  void on_field(const field_msgs::FieldMeasurement& message);
  /// False if the pose cannot be used; the belief is unchanged then.
  bool on_initialpose(const geometry_msgs::PoseWithCovarianceStamped& message);
  /// No more messages: processes what only waited for the reorder window. Returns how many
  /// measurements are left without odometry.
  std::size_t finish();

  void reset();
  void scatter();
  /// While paused, odometry is followed and measurements are dropped.
  void set_paused(bool paused);
  bool paused() const { return paused_; }

  field_msgs::EstimatorState save_state() const;
  /// Refuses a state of another estimator, version or configuration (but for the parameters of
  /// may_differ_from_state()). @throws DataError saying what differs; nothing has changed then
  void restore(const field_msgs::EstimatorState& message);

  const field_core::Belief& belief() const { return belief_; }
  /// map -> odom; nullopt before the first odometry.
  const std::optional<field_core::SE2>& map_to_odom() const { return map_to_odom_; }
  std::optional<OdometrySample> newest_odometry() const { return merge_.newest_odometry(); }
  std::size_t pending() const { return merge_.pending(); }
  std::size_t waiting_for_transform() const { return placement_.size(); }
  /// The estimator's own verdict if it has one, else that of its last innovations.
  field_core::Health health() const;
  /// NIS per degree of freedom of the last `lost_window` measurements.
  double recent_nis() const { return monitor_.ratio(); }
  const AnyEstimator& estimator() const { return *estimator_; }
  const NodeParams& params() const { return params_; }
  void set_runtime_params(const RuntimeParams& params) {
    static_cast<RuntimeParams&>(params_) = params;
  }
  const SessionCounts& counts() const { return counts_; }
  const std::string& last_error() const { return last_error_; }

 private:
  void drop(DropReason reason) { ++counts_.dropped[drop_name(reason)]; }
  /// 0 is a time like any other at the start of a recording or of simulated time, not later.
  bool unstamped(field_core::Stamp stamp) const;
  /// Steps that are due before something else changes the pose.
  void settle();
  void process(bool end_of_input = false);
  void take_placed();
  void start_clock_again();
  void step(const MergedStep& merged);
  void judge(const field_core::UpdateResult& result);
  void forget_verdict();
  void require_same_configuration(const field_msgs::EstimatorState& message) const;
  void refresh_belief(field_core::Stamp stamp);

  NodeParams params_;
  std::unique_ptr<AnyEstimator> estimator_;
  std::string configuration_;
  std::function<ParamValues(const ParamTree&)> values_;
  std::vector<std::string> run_parameters_;
  FieldIndex fields_;
  PlacementQueue placement_;
  StreamMerge merge_;
  LostMonitor monitor_;
  Listener listener_;
  SessionCounts counts_;
  field_core::Belief belief_;
  std::optional<field_core::SE2> map_to_odom_;
  std::string last_error_;
  bool paused_ = false;
  bool deferred_ = false;
  bool lost_ = false;
};

}  // namespace field_ros
