#include "field_ros/stream_merge.hpp"

#include <algorithm>

namespace field_ros {

using field_core::Sample;
using field_core::SE2;
using field_core::Stamp;

StreamMerge::StreamMerge(const MergeLimits& limits, OnDrop on_drop)
    : limits_(limits), on_drop_(std::move(on_drop)) {}

void StreamMerge::clear() {
  odometry_.clear();
  queue_.clear();
  after_jump_.clear();
  candidate_.reset();
  anchor_.reset();
  stepped_ = false;
}

std::optional<OdometrySample> StreamMerge::newest_odometry() const {
  if (odometry_.empty()) return std::nullopt;
  return odometry_.back();
}

void StreamMerge::push_odometry(const OdometrySample& odometry) {
  odometry_.push_back(odometry);
  if (odometry_.size() > limits_.odometry) odometry_.pop_front();
  if (!anchor_) anchor_ = odometry;
}

void StreamMerge::give_up_candidate() {
  if (!candidate_) return;
  on_drop_(DropReason::odometry_stray_stamp);
  candidate_.reset();
  for (std::size_t i = 0; i < after_jump_.size(); ++i) on_drop_(DropReason::older_than_processed);
  after_jump_.clear();
}

bool StreamMerge::handle_jump(const OdometrySample& odometry) {
  const bool confirmed = candidate_ && odometry.stamp > candidate_->stamp &&
                         odometry.stamp - candidate_->stamp <= limits_.odometry_gap;
  if (!confirmed) {
    give_up_candidate();
    candidate_ = odometry;
    return false;
  }
  const bool back = odometry.stamp < odometry_.back().stamp;
  const OdometrySample first = *candidate_;
  std::deque<Waiting> kept = std::move(after_jump_);
  if (back) {
    clear();
    queue_ = std::move(kept);
  }
  after_jump_.clear();
  candidate_.reset();
  push_odometry(first);
  push_odometry(odometry);
  return back;
}

bool StreamMerge::add_odometry(const OdometrySample& odometry) {
  if (odometry_.empty()) {
    push_odometry(odometry);
    return false;
  }
  const Stamp ahead = odometry.stamp - odometry_.back().stamp;
  if (ahead < -limits_.time_jump || ahead > limits_.odometry_gap) return handle_jump(odometry);
  give_up_candidate();
  if (ahead <= Stamp(0)) {
    on_drop_(DropReason::odometry_out_of_order);
    return false;
  }
  push_odometry(odometry);
  return false;
}

void StreamMerge::add_sample(Sample sample,
                             std::optional<field_core::PositionObservation> position) {
  const auto later = [](Stamp stamp, const Waiting& other) { return stamp < other.sample.stamp; };
  const bool maybe_restarted = candidate_ && candidate_->stamp < odometry_.back().stamp &&
                               sample.stamp + limits_.time_jump < odometry_.back().stamp;
  if (!maybe_restarted && stepped_ && sample.stamp < anchor_->stamp) {
    on_drop_(DropReason::older_than_processed);
    return;
  }
  std::deque<Waiting>& queue = maybe_restarted ? after_jump_ : queue_;
  queue.insert(std::upper_bound(queue.begin(), queue.end(), sample.stamp, later),
               Waiting{std::move(sample), std::move(position)});
  if (queue.size() > limits_.pending) {
    on_drop_(DropReason::queue_full);
    queue.pop_front();
  }
}

std::optional<SE2> StreamMerge::pose_at(Stamp stamp) const {
  if (anchor_ && stamp == anchor_->stamp) return anchor_->pose;
  const auto after = std::lower_bound(odometry_.begin(), odometry_.end(), stamp,
                                      [](const OdometrySample& o, Stamp s) { return o.stamp < s; });
  if (after == odometry_.end()) return std::nullopt;
  if (after->stamp == stamp) return after->pose;
  if (after == odometry_.begin()) return std::nullopt;
  const auto before = std::prev(after);
  const double fraction = static_cast<double>((stamp - before->stamp).count()) /
                          static_cast<double>((after->stamp - before->stamp).count());
  return field_core::interpolate(before->pose, after->pose, fraction);
}

std::optional<Stamp> StreamMerge::ready_stamp(bool end_of_input) {
  const Stamp wait = end_of_input ? Stamp(0) : limits_.reorder_window;
  while (!queue_.empty() && anchor_) {
    const Stamp stamp = queue_.front().sample.stamp;
    const bool too_old = stamp < anchor_->stamp;
    if (!too_old && odometry_.back().stamp < stamp + wait) return std::nullopt;
    if (!too_old && pose_at(stamp)) return stamp;
    if (too_old) {
      on_drop_(stepped_ ? DropReason::older_than_processed : DropReason::before_odometry);
    } else {
      on_drop_(DropReason::older_than_buffer);
    }
    queue_.pop_front();
  }
  return std::nullopt;
}

std::optional<MergedStep> StreamMerge::next(bool end_of_input) {
  const std::optional<Stamp> stamp = ready_stamp(end_of_input);
  if (!stamp) return std::nullopt;
  const SE2 pose = *pose_at(*stamp);
  Waiting& front = queue_.front();
  MergedStep step{{anchor_->stamp, *stamp, anchor_->pose.between(pose)},
                  std::move(front.sample),
                  pose,
                  std::move(front.position)};
  queue_.pop_front();
  anchor_ = OdometrySample{*stamp, pose};
  stepped_ = true;
  return step;
}

bool StreamMerge::ready(const Waiting& waiting) const {
  return anchor_ && odometry_.back().stamp >= waiting.sample.stamp + limits_.reorder_window;
}

void StreamMerge::shed(Stamp most_lag) {
  const auto newest =
      std::find_if(queue_.rbegin(), queue_.rend(), [this](const Waiting& w) { return ready(w); });
  if (newest == queue_.rend()) return;
  const Stamp oldest_allowed = newest->sample.stamp - most_lag;
  while (queue_.front().sample.stamp < oldest_allowed) {
    on_drop_(DropReason::shed);
    queue_.pop_front();
  }
}

bool StreamMerge::move_anchor(Stamp stamp) {
  if (odometry_.empty()) return false;
  const std::optional<SE2> pose = pose_at(stamp);
  anchor_ = pose ? OdometrySample{stamp, *pose} : odometry_.back();
  return true;
}

void StreamMerge::move_anchor_to_newest() {
  if (!odometry_.empty()) anchor_ = odometry_.back();
}

}  // namespace field_ros
