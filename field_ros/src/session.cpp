#include "field_ros/session.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "field_ros/convert.hpp"

namespace field_ros {

using field_core::Stamp;
using field_core::stamp_from_seconds;

Session::Session(Configured configured, PlacementLookup placement)
    : params_(std::move(configured.node)),
      estimator_(std::move(configured.estimator)),
      configuration_(std::move(configured.configuration)),
      values_(std::move(configured.values)),
      run_parameters_(std::move(configured.run_parameters)),
      fields_(index_fields(estimator_->fields())),
      placement_(std::move(placement)) {
  for (RobotInterface& robot : robot_interfaces(params_, estimator_->robots())) {
    const std::string base = robot.base_frame_id;
    streams_.push_back(std::make_unique<RobotStream>(
        std::move(robot), params_, [this, base](const std::string& frame, Stamp stamp) {
          return placement_(base, frame, stamp);
        }));
    streams_.back()->belief = estimator_->belief(robots() - 1);
  }
}

void Session::on_odometry(const nav_msgs::Odometry& message, int robot) {
  RobotStream& r = stream(robot);
  const auto odometry = r.check(message);
  if (!odometry) return;
  // Steps of a clock that ends here are made before it is forgotten.
  if (r.newest_odometry() && odometry->stamp < *r.newest_odometry()) settle();
  if (r.merge.add_odometry(*odometry)) start_clock_again(robot);
  r.take_placed();
  if (!r.map_to_odom && r.merge.anchor()) refresh_belief(robot, r.merge.anchor()->stamp);
  if (!deferred_) process();
}

// The robots share one clock. The first to notice that it was set back resets the estimator; those
// that follow have nothing to lose any more.
void Session::start_clock_again(int robot) {
  RobotStream& first = stream(robot);
  ++first.counts.clock_resets;
  const Stamp now = *first.newest_odometry();
  const Stamp jump = stamp_from_seconds(params_.time_jump_threshold);
  const bool follows = std::any_of(streams_.begin(), streams_.end(), [&](const auto& other) {
    return other.get() != &first && other->newest_odometry() &&
           *other->newest_odometry() <= now + jump;
  });
  first.placement.clear();
  first.forget_verdict();
  first.map_to_odom.reset();
  if (follows) return;
  estimator_->reset();
  for (const auto& other : streams_) {
    if (other.get() != &first) other->forget();
  }
}

void Session::on_field(const field_msgs::FieldMeasurement& message, int robot) {
  stream(robot).on_field(message, fields_, paused_);
  if (!deferred_) process();
}

void Session::on_position(const geometry_msgs::PoseWithCovarianceStamped& message, int robot) {
  stream(robot).on_position(message, paused_);
  if (!deferred_) process();
}

bool Session::on_initialpose(const geometry_msgs::PoseWithCovarianceStamped& message, int robot) {
  RobotStream& r = stream(robot);
  const auto guess = check_initialpose(message, params_.global_frame_id);
  if (!guess) {
    r.drop(guess.reason);
    return false;
  }
  settle();
  r.merge.move_anchor(guess.value->stamp);
  estimator_->set_pose(guess.value->pose, guess.value->covariance, robot);
  r.forget_verdict();
  refresh_belief_at_anchor(robot, guess.value->stamp);
  return true;
}

std::size_t Session::finish() {
  std::size_t left = 0;
  for (const auto& r : streams_) r->take_placed(true);
  process(true);
  for (const auto& r : streams_) left += r->merge.pending();
  return left;
}

int Session::next_robot(bool end_of_input) {
  int next = -1;
  Stamp earliest{0};
  for (int robot = 0; robot < robots(); ++robot) {
    const auto stamp = stream(robot).merge.ready_stamp(end_of_input || is_silent(robot));
    if (!stamp || (next >= 0 && *stamp >= earliest)) continue;
    next = robot;
    earliest = *stamp;
  }
  const bool wait = next >= 0 && !end_of_input && awaits_another(next, earliest);
  return wait ? -1 : next;
}

bool Session::awaits_another(int robot, Stamp stamp) const {
  const Stamp known = stamp + stamp_from_seconds(params_.reorder_window);
  for (int other = 0; other < robots(); ++other) {
    const auto until = stream(other).newest_odometry();
    if (other != robot && until && *until < known && !is_silent(other)) return true;
  }
  return false;
}

bool Session::is_silent(int robot) const {
  const auto own = stream(robot).newest_odometry();
  if (robots() == 1 || !own) return false;
  const Stamp patience = stamp_from_seconds(params_.robot_patience);
  return std::any_of(streams_.begin(), streams_.end(),
                     [&](const auto& other) { return other->newest_odometry() > *own + patience; });
}

bool Session::step_next() {
  if (params_.max_pose_lag > 0.0) {
    for (const auto& r : streams_) r->merge.shed(stamp_from_seconds(params_.max_pose_lag));
  }
  const int robot = next_robot(false);
  if (robot < 0) return false;
  step(robot, false);
  return true;
}

void Session::settle() {
  while (deferred_ && step_next()) {
  }
}

void Session::set_paused(bool paused) {
  settle();
  paused_ = paused;
}

void Session::process(bool end_of_input) {
  for (int robot = next_robot(end_of_input); robot >= 0; robot = next_robot(end_of_input)) {
    step(robot, end_of_input);
  }
}

void Session::step(int robot, bool end_of_input) {
  RobotStream& r = stream(robot);
  const MergedStep merged = *r.merge.next(end_of_input || is_silent(robot));
  const auto start = std::chrono::steady_clock::now();
  ++r.counts.steps;
  try {
    estimator_->predict(merged.increment, robot);
    const field_core::UpdateResult result = measure(merged, robot);
    judge(result, robot);
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    refresh_belief(robot, merged.sample.stamp);
    if (r.lost) ++r.counts.lost;
    if (result.applied) {
      ++r.counts.applied;
      if (*result.reason) ++r.counts.noted[result.reason];
      r.counts.nis_sum += result.nis_dof > 0 ? result.nis : 0.0;
      r.counts.nis_dof_sum += static_cast<std::uint64_t>(std::max(result.nis_dof, 0));
    } else {
      ++r.counts.skipped[result.reason];
    }
    if (listener_) listener_({r.belief, result, merged.odom_pose, taken.count(), robot});
  } catch (const field_core::NumericalError& e) {
    ++r.counts.numerical_errors;
    r.drop(DropReason::numerical_error);
    r.last_error = e.what();
  }
}

field_core::UpdateResult Session::measure(const MergedStep& merged, int robot) {
  if (merged.position) return estimator_->observe_position(*merged.position, robot);
  return estimator_->update(merged.sample, robot);
}

void Session::judge(const field_core::UpdateResult& result, int robot) {
  RobotStream& r = stream(robot);
  r.monitor.add(result, params_.lost_nis);
  const bool was_lost = std::exchange(r.lost, health(robot).lost);
  if (!params_.recovery || was_lost || !r.lost) return;
  ++r.counts.recoveries;
  estimator_->scatter(robot);
  r.forget_verdict();
}

field_core::Health Session::health(int robot) const {
  if (const auto own = estimator_->health(robot)) return *own;
  if (!stream(robot).monitor.lost()) return {};
  return {true, "the last measurements differ from the map far more than expected"};
}

void Session::refresh_belief(int robot, Stamp stamp) {
  stream(robot).set_belief(estimator_->belief(robot), stamp);
}

void Session::refresh_belief_at_anchor(int robot, Stamp otherwise) {
  const auto& anchor = stream(robot).merge.anchor();
  refresh_belief(robot, anchor ? anchor->stamp : otherwise);
}

void Session::reset() {
  estimator_->reset();
  for (int robot = 0; robot < robots(); ++robot) {
    stream(robot).forget();
    stream(robot).belief = estimator_->belief(robot);
  }
}

void Session::scatter(int robot) {
  RobotStream& r = stream(robot);
  settle();
  r.forget_verdict();
  estimator_->scatter(robot);
  r.merge.move_anchor_to_newest();
  refresh_belief_at_anchor(robot, r.belief.stamp);
}

Stamp Session::stamp() const {
  Stamp newest{0};
  for (const auto& r : streams_) newest = std::max(newest, r->belief.stamp);
  return newest;
}

SessionCounts Session::total() const {
  SessionCounts total;
  for (const auto& r : streams_) total += r->counts;
  return total;
}

std::uint64_t Session::applied() const {
  std::uint64_t sum = 0;
  for (const auto& r : streams_) sum += r->counts.applied;
  return sum;
}

field_msgs::EstimatorState Session::save_state() const {
  field_msgs::EstimatorState message = to_message(estimator_->state());
  message.header.stamp = to_ros(stamp());
  message.header.frame_id = params_.global_frame_id;
  message.configuration = configuration_;
  return message;
}

void Session::require_same_configuration(const field_msgs::EstimatorState& message) const {
  // Another estimator's state is refused by the estimator itself, in words of its own.
  if (message.estimator != estimator_->name()) return;
  ParamValues theirs;
  try {
    theirs = values_(ParamTree::from_yaml_text(message.configuration, "its configuration"));
  } catch (const field_core::DataError& e) {
    throw field_core::DataError("the state was saved by another version (" + std::string(e.what()) +
                                "); load it with the version that saved it");
  }
  const auto ours = values_(ParamTree::from_yaml_text(configuration_, "this configuration"));
  const std::string differences = describe_differences(theirs, ours, run_parameters_);
  if (differences.empty()) return;
  throw field_core::DataError("the state was saved with another configuration (" + differences +
                              "); use that one, it is in the state's 'configuration'");
}

void Session::restore(const field_msgs::EstimatorState& message) {
  require_same_configuration(message);
  settle();
  estimator_->restore(from_message(message));
  for (int robot = 0; robot < robots(); ++robot) {
    stream(robot).forget_verdict();
    stream(robot).merge.move_anchor_to_newest();
    refresh_belief_at_anchor(robot, from_ros(message.header.stamp));
  }
}

}  // namespace field_ros
