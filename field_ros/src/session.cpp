#include "field_ros/session.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "field_ros/convert.hpp"

namespace field_ros {
namespace {

using field_core::Stamp;
using field_core::stamp_from_seconds;

MergeLimits limits(const NodeParams& params) {
  MergeLimits limits;
  limits.odometry = static_cast<std::size_t>(params.odom_buffer_length);
  limits.pending = static_cast<std::size_t>(params.pending_measurements);
  limits.reorder_window = stamp_from_seconds(params.reorder_window);
  limits.time_jump = stamp_from_seconds(params.time_jump_threshold);
  limits.odometry_gap = stamp_from_seconds(params.odom_gap_threshold);
  return limits;
}

}  // namespace

Session::Session(Configured configured, SensorPlacement placement)
    : params_(std::move(configured.node)),
      estimator_(std::move(configured.estimator)),
      configuration_(std::move(configured.configuration)),
      values_(std::move(configured.values)),
      run_parameters_(std::move(configured.run_parameters)),
      fields_(index_fields(estimator_->fields())),
      placement_(std::move(placement), stamp_from_seconds(params_.sensor_transform_timeout),
                 static_cast<std::size_t>(params_.pending_measurements),
                 [this](DropReason reason) { drop(reason); }),
      merge_(limits(params_), [this](DropReason reason) { drop(reason); }),
      monitor_(static_cast<std::size_t>(params_.lost_window)),
      belief_(estimator_->belief()) {}

void Session::on_odometry(const nav_msgs::Odometry& message) {
  ++counts_.odometry;
  const auto odometry = check_odometry(message, params_.odom_frame_id, params_.base_frame_id);
  if (!odometry) return drop(odometry.reason);
  // Steps of a clock that ends here are made before it is forgotten.
  if (merge_.newest_odometry() && odometry.value->stamp < merge_.newest_odometry()->stamp) settle();
  if (merge_.add_odometry(*odometry.value)) start_clock_again();
  take_placed();
  if (!map_to_odom_ && merge_.anchor()) refresh_belief(merge_.anchor()->stamp);
  if (!deferred_) process();
}

void Session::start_clock_again() {
  ++counts_.clock_resets;
  placement_.clear();
  forget_verdict();
  estimator_->reset();
  map_to_odom_.reset();
}

void Session::on_field(const field_msgs::FieldMeasurement& message) {
  ++counts_.measurements;
  if (paused_) return drop(DropReason::paused);
  auto field =
      check_field(message, fields_, static_cast<std::size_t>(params_.max_fields_per_message));
  if (!field) return drop(field.reason);
  if (unstamped(field.value->stamp)) return drop(DropReason::zero_stamp);
  field_core::Sample sample;
  sample.stamp = field.value->stamp;
  sample.readings = std::move(field.value->readings);
  counts_.unknown_fields += static_cast<std::uint64_t>(field.value->unknown_fields);
  std::string& frame = field.value->frame;
  if (!params_.use_sensor_frames || frame == params_.base_frame_id) frame.clear();
  placement_.add(std::move(sample), std::move(frame));
  take_placed();
  if (!deferred_) process();
}

void Session::take_placed() {
  const auto newest = merge_.newest_odometry();
  const auto now = newest ? std::optional<Stamp>(newest->stamp) : std::nullopt;
  while (auto sample = placement_.next(now)) merge_.add_sample(std::move(*sample));
}

bool Session::unstamped(Stamp stamp) const {
  const auto newest = merge_.newest_odometry();
  return stamp == Stamp(0) && newest && newest->stamp > Stamp(0);
}

bool Session::on_initialpose(const geometry_msgs::PoseWithCovarianceStamped& message) {
  const auto guess = check_initialpose(message, params_.global_frame_id);
  if (!guess) {
    drop(guess.reason);
    return false;
  }
  settle();
  merge_.move_anchor(guess.value->stamp);
  estimator_->set_pose(guess.value->pose, guess.value->covariance);
  forget_verdict();
  refresh_belief(merge_.anchor() ? merge_.anchor()->stamp : guess.value->stamp);
  return true;
}

std::size_t Session::finish() {
  while (auto sample = placement_.next_at_end()) merge_.add_sample(std::move(*sample));
  process(true);
  return merge_.pending();
}

bool Session::step_next() {
  if (params_.max_pose_lag > 0.0) merge_.shed(stamp_from_seconds(params_.max_pose_lag));
  const auto merged = merge_.next();
  if (merged) step(*merged);
  return merged.has_value();
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
  while (auto merged = merge_.next(end_of_input)) step(*merged);
}

void Session::step(const MergedStep& merged) {
  const auto start = std::chrono::steady_clock::now();
  field_core::UpdateResult result;
  ++counts_.steps;
  try {
    estimator_->predict(merged.increment);
    result = estimator_->update(merged.sample);
    judge(result);
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    refresh_belief(merged.sample.stamp);
    if (lost_) ++counts_.lost;
    if (result.applied) {
      ++counts_.applied;
      if (*result.reason) ++counts_.noted[result.reason];
      counts_.nis_sum += result.nis_dof > 0 ? result.nis : 0.0;
      counts_.nis_dof_sum += static_cast<std::uint64_t>(std::max(result.nis_dof, 0));
    } else {
      ++counts_.skipped[result.reason];
    }
    if (listener_) listener_({belief_, result, merged.odom_pose, taken.count()});
  } catch (const field_core::NumericalError& e) {
    ++counts_.numerical_errors;
    drop(DropReason::numerical_error);
    last_error_ = e.what();
  }
}

void Session::judge(const field_core::UpdateResult& result) {
  monitor_.add(result, params_.lost_nis);
  const bool was_lost = std::exchange(lost_, health().lost);
  if (!params_.recovery || was_lost || !lost_) return;
  ++counts_.recoveries;
  estimator_->scatter();
  forget_verdict();
}

void Session::forget_verdict() {
  monitor_.clear();
  lost_ = false;
}

field_core::Health Session::health() const {
  if (const auto own = estimator_->health()) return *own;
  if (!monitor_.lost()) return {};
  return {true, "the last measurements differ from the map far more than expected"};
}

void Session::refresh_belief(Stamp stamp) {
  belief_ = estimator_->belief();
  belief_.stamp = stamp;
  if (merge_.anchor()) map_to_odom_ = belief_.mean * merge_.anchor()->pose.inverse();
}

void Session::reset() {
  placement_.clear();
  merge_.clear();
  forget_verdict();
  map_to_odom_.reset();
  estimator_->reset();
  belief_ = estimator_->belief();
}

void Session::scatter() {
  settle();
  forget_verdict();
  estimator_->scatter();
  merge_.move_anchor_to_newest();
  refresh_belief(merge_.anchor() ? merge_.anchor()->stamp : belief_.stamp);
}

field_msgs::EstimatorState Session::save_state() const {
  field_msgs::EstimatorState message = to_message(estimator_->state());
  message.header.stamp = to_ros(belief_.stamp);
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
  forget_verdict();
  merge_.move_anchor_to_newest();
  refresh_belief(merge_.anchor() ? merge_.anchor()->stamp : from_ros(message.header.stamp));
}

}  // namespace field_ros
