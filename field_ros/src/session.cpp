#include "field_ros/session.hpp"

#include <algorithm>
#include <chrono>

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
      placement_(std::move(placement)),
      fields_(index_fields(estimator_->fields())),
      merge_(limits(params_), [this](DropReason reason) { drop(reason); }),
      belief_(estimator_->belief()) {}

void Session::on_odometry(const nav_msgs::Odometry& message) {
  ++counts_.odometry;
  const auto odometry = check_odometry(message, params_.odom_frame_id, params_.base_frame_id);
  if (!odometry) return drop(odometry.reason);
  if (merge_.add_odometry(*odometry.value)) {
    ++counts_.clock_resets;
    estimator_->reset();
    map_to_odom_.reset();
  }
  if (!map_to_odom_ && merge_.anchor()) refresh_belief(merge_.anchor()->stamp);
  process();
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
  const std::string& frame = field.value->frame;
  if (params_.use_sensor_frames && !frame.empty() && frame != params_.base_frame_id) {
    const auto place = placement_(frame, sample.stamp);
    if (!place) return drop(DropReason::unknown_frame);
    sample.sensor_in_base = *place;
  }
  sample.readings = std::move(field.value->readings);
  counts_.unknown_fields += static_cast<std::uint64_t>(field.value->unknown_fields);
  merge_.add_sample(std::move(sample));
  process();
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
  merge_.move_anchor(guess.value->stamp);
  estimator_->set_pose(guess.value->pose, guess.value->covariance);
  refresh_belief(merge_.anchor() ? merge_.anchor()->stamp : guess.value->stamp);
  return true;
}

std::size_t Session::finish() {
  process(true);
  return merge_.pending();
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
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    refresh_belief(merged.sample.stamp);
    if (estimator_->health().lost) ++counts_.lost;
    if (result.applied) {
      ++counts_.applied;
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

void Session::refresh_belief(Stamp stamp) {
  belief_ = estimator_->belief();
  belief_.stamp = stamp;
  if (merge_.anchor()) map_to_odom_ = belief_.mean * merge_.anchor()->pose.inverse();
}

void Session::reset() {
  merge_.clear();
  map_to_odom_.reset();
  estimator_->reset();
  belief_ = estimator_->belief();
}

void Session::scatter() {
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

void Session::restore(const field_msgs::EstimatorState& message) {
  estimator_->restore(from_message(message));
  merge_.move_anchor_to_newest();
  refresh_belief(merge_.anchor() ? merge_.anchor()->stamp : from_ros(message.header.stamp));
}

}  // namespace field_ros
