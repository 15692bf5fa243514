#include "field_ros/robot_stream.hpp"

#include <utility>

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

void add(const Counts& from, Counts& to) {
  for (const auto& [name, count] : from) to[name] += count;
}

}  // namespace

SessionCounts& SessionCounts::operator+=(const SessionCounts& other) {
  odometry += other.odometry;
  measurements += other.measurements;
  steps += other.steps;
  applied += other.applied;
  lost += other.lost;
  numerical_errors += other.numerical_errors;
  clock_resets += other.clock_resets;
  recoveries += other.recoveries;
  unknown_fields += other.unknown_fields;
  add(other.skipped, skipped);
  add(other.noted, noted);
  add(other.dropped, dropped);
  nis_sum += other.nis_sum;
  nis_dof_sum += other.nis_dof_sum;
  return *this;
}

RobotStream::RobotStream(RobotInterface interface, const NodeParams& params, SensorPlacement place)
    : merge(limits(params), [this](DropReason reason) { drop(reason); }),
      placement(std::move(place), stamp_from_seconds(params.sensor_transform_timeout),
                static_cast<std::size_t>(params.pending_measurements),
                [this](DropReason reason) { drop(reason); }),
      monitor(static_cast<std::size_t>(params.lost_window)),
      interface_(std::move(interface)),
      global_frame_(params.global_frame_id),
      max_fields_(static_cast<std::size_t>(params.max_fields_per_message)),
      use_sensor_frames_(params.use_sensor_frames) {}

std::optional<OdometrySample> RobotStream::check(const nav_msgs::Odometry& message) {
  ++counts.odometry;
  const auto odometry = check_odometry(message, interface_.odom_frame_id, interface_.base_frame_id);
  if (!odometry) drop(odometry.reason);
  return odometry.value;
}

void RobotStream::on_field(const field_msgs::FieldMeasurement& message, const FieldIndex& fields,
                           bool paused) {
  ++counts.measurements;
  if (paused) return drop(DropReason::paused);
  auto field = check_field(message, fields, max_fields_);
  if (!field) return drop(field.reason);
  if (unstamped(field.value->stamp)) return drop(DropReason::zero_stamp);
  field_core::Sample sample;
  sample.stamp = field.value->stamp;
  sample.readings = std::move(field.value->readings);
  counts.unknown_fields += static_cast<std::uint64_t>(field.value->unknown_fields);
  std::string& frame = field.value->frame;
  if (!use_sensor_frames_ || frame == interface_.base_frame_id) frame.clear();
  placement.add(std::move(sample), std::move(frame));
  take_placed();
}

void RobotStream::on_position(const geometry_msgs::PoseWithCovarianceStamped& message,
                              bool paused) {
  ++counts.measurements;
  if (paused) return drop(DropReason::paused);
  const auto seen = check_position(message, global_frame_);
  if (!seen) return drop(seen.reason);
  if (unstamped(seen.value->stamp)) return drop(DropReason::zero_stamp);
  field_core::Sample sample;
  sample.stamp = seen.value->stamp;
  merge.add_sample(std::move(sample), seen.value->observation);
}

void RobotStream::take_placed(bool end) {
  const auto now = newest_odometry();
  while (auto sample = end ? placement.next_at_end() : placement.next(now)) {
    merge.add_sample(std::move(*sample));
  }
}

std::optional<Stamp> RobotStream::newest_odometry() const {
  const auto newest = merge.newest_odometry();
  return newest ? std::optional<Stamp>(newest->stamp) : std::nullopt;
}

bool RobotStream::unstamped(Stamp stamp) const {
  const auto newest = newest_odometry();
  return stamp == Stamp(0) && newest && *newest > Stamp(0);
}

void RobotStream::forget_verdict() {
  monitor.clear();
  lost = false;
}

void RobotStream::forget() {
  placement.clear();
  merge.clear();
  forget_verdict();
  map_to_odom.reset();
}

void RobotStream::set_belief(field_core::Belief now, Stamp stamp) {
  belief = std::move(now);
  belief.stamp = stamp;
  if (merge.anchor()) map_to_odom = belief.mean * merge.anchor()->pose.inverse();
}

}  // namespace field_ros
