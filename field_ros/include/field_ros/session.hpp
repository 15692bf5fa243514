// The one path from messages to the estimator, walked alike by the live node and by the replay.
//
// A session serves all robots of its estimator, which are mostly one: `robot` is an index of
// robots(), and 0 where it is not given. Each robot's messages go through a RobotStream of its own;
// the steps of all go into the one estimator in order of their stamps. A robot may begin, fall
// silent and come back at any time: only one whose odometry is less than robot_patience behind the
// newest is waited for.
#pragma once

#include <field_msgs/EstimatorState.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "field_ros/any_estimator.hpp"
#include "field_ros/robot_stream.hpp"

namespace field_ros {

/// One sample, processed.
struct SessionStep {
  const field_core::Belief& belief;
  const field_core::UpdateResult& result;
  field_core::SE2 odom_pose;
  double step_s;  ///< wall-clock time of predict and update
  int robot;
};

/// Pose of a sensor's frame in a robot's base frame at a time; nullopt: tf does not know it.
using PlacementLookup = std::function<std::optional<field_core::SE2>(
    const std::string& base, const std::string& frame, field_core::Stamp stamp)>;

class Session {
 public:
  using Listener = std::function<void(const SessionStep&)>;

  Session(Configured configured, PlacementLookup placement);

  void set_listener(Listener listener) { listener_ = std::move(listener); }

  /// From now on messages only wait; the owner calls step_next(). A live node takes in all that has
  /// come before each step, so that under overload the oldest can be left out (max_pose_lag).
  void defer_steps() { deferred_ = true; }
  bool step_ready() { return next_robot(false) >= 0; }
  /// One step, if one is ready; false if none was made.
  bool step_next();

  /// None of these throws because of a message: what cannot be used is dropped and counted.
  void on_odometry(const nav_msgs::Odometry& message, int robot = 0);
  void on_field(const field_msgs::FieldMeasurement& message, int robot = 0);
  void on_position(const geometry_msgs::PoseWithCovarianceStamped& message, int robot = 0);
  /// False if the pose cannot be used; the belief is unchanged then.
  bool on_initialpose(const geometry_msgs::PoseWithCovarianceStamped& message, int robot = 0);
  /// No more messages: processes what only waited for the reorder window. Returns how many
  /// measurements are left without odometry.
  std::size_t finish();

  void reset();
  void scatter(int robot);
  /// While paused, odometry is followed and measurements are dropped.
  void set_paused(bool paused);
  bool paused() const { return paused_; }

  field_msgs::EstimatorState save_state() const;
  /// Refuses a state of another estimator, version or configuration (but for the parameters of
  /// may_differ_from_state()). @throws DataError saying what differs; nothing has changed then
  void restore(const field_msgs::EstimatorState& message);

  int robots() const { return static_cast<int>(streams_.size()); }
  const RobotInterface& interface(int robot) const { return stream(robot).interface(); }
  const field_core::Belief& belief(int robot = 0) const { return stream(robot).belief; }
  /// map -> odom; nullopt before the first odometry.
  const std::optional<field_core::SE2>& map_to_odom(int robot = 0) const {
    return stream(robot).map_to_odom;
  }
  std::optional<OdometrySample> newest_odometry(int robot = 0) const {
    return stream(robot).merge.newest_odometry();
  }
  std::size_t pending(int robot = 0) const { return stream(robot).merge.pending(); }
  std::size_t waiting_for_transform(int robot = 0) const { return stream(robot).placement.size(); }
  /// The estimator's own verdict if it has one, else that of the robot's last innovations.
  field_core::Health health(int robot = 0) const;
  /// NIS per degree of freedom of the last `lost_window` measurements.
  double recent_nis(int robot = 0) const { return stream(robot).monitor.ratio(); }
  const SessionCounts& counts(int robot = 0) const { return stream(robot).counts; }
  /// "" if there was none.
  const std::string& last_error(int robot = 0) const { return stream(robot).last_error; }

  /// Stamp of the newest step of all.
  field_core::Stamp stamp() const;
  /// Over all robots.
  SessionCounts total() const;
  std::uint64_t applied() const;

  const AnyEstimator& estimator() const { return *estimator_; }
  const NodeParams& params() const { return params_; }
  void set_runtime_params(const RuntimeParams& params) {
    static_cast<RuntimeParams&>(params_) = params;
  }

 private:
  RobotStream& stream(int robot) { return *streams_.at(static_cast<std::size_t>(robot)); }
  const RobotStream& stream(int robot) const {
    return *streams_.at(static_cast<std::size_t>(robot));
  }
  /// Whose step is next: of those that are ready the earliest, unless another robot may have an
  /// earlier one still; -1: none.
  int next_robot(bool end_of_input);
  bool awaits_another(int robot, field_core::Stamp stamp) const;
  /// Its odometry is more than robot_patience behind the newest of all: what it has sent is all
  /// that comes for now.
  bool is_silent(int robot) const;
  /// Steps that are due before something else changes the pose.
  void settle();
  void process(bool end_of_input = false);
  void start_clock_again(int robot);
  void step(int robot, bool end_of_input);
  field_core::UpdateResult measure(const MergedStep& merged, int robot);
  void judge(const field_core::UpdateResult& result, int robot);
  void require_same_configuration(const field_msgs::EstimatorState& message) const;
  void refresh_belief(int robot, field_core::Stamp stamp);
  /// After the belief has been replaced: as of the robot's anchor, or of `otherwise`.
  void refresh_belief_at_anchor(int robot, field_core::Stamp otherwise);

  NodeParams params_;
  std::unique_ptr<AnyEstimator> estimator_;
  std::string configuration_;
  std::function<ParamValues(const ParamTree&)> values_;
  std::vector<std::string> run_parameters_;
  FieldIndex fields_;
  PlacementLookup placement_;
  std::vector<std::unique_ptr<RobotStream>> streams_;
  Listener listener_;
  bool paused_ = false;
  bool deferred_ = false;
};

}  // namespace field_ros
