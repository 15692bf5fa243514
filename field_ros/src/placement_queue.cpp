#include "field_ros/placement_queue.hpp"

namespace field_ros {

using field_core::Sample;
using field_core::Stamp;

PlacementQueue::PlacementQueue(SensorPlacement placement, Stamp patience, std::size_t most,
                               OnDrop on_drop)
    : placement_(std::move(placement)),
      patience_(patience),
      most_(most),
      on_drop_(std::move(on_drop)) {}

void PlacementQueue::add(Sample sample, std::string frame) {
  queue_.push_back({std::move(sample), std::move(frame)});
  if (queue_.size() > most_) {
    on_drop_(DropReason::queue_full);
    queue_.pop_front();
  }
}

bool PlacementQueue::place_front() {
  Waiting& front = queue_.front();
  if (front.frame.empty()) return true;
  const auto place = placement_(front.frame, front.sample.stamp);
  if (!place) return false;
  front.sample.sensor_in_base = *place;
  missing_.erase(front.frame);
  return true;
}

void PlacementQueue::give_up_front() {
  on_drop_(DropReason::unknown_frame);
  missing_.insert(queue_.front().frame);
  queue_.pop_front();
}

Sample PlacementQueue::take_front() {
  Sample sample = std::move(queue_.front().sample);
  queue_.pop_front();
  return sample;
}

std::optional<Sample> PlacementQueue::next(std::optional<Stamp> now) {
  while (!queue_.empty()) {
    if (place_front()) return take_front();
    const Waiting& front = queue_.front();
    const bool known_missing = missing_.count(front.frame) > 0;
    if (!known_missing && (!now || *now < front.sample.stamp + patience_)) return std::nullopt;
    give_up_front();
  }
  return std::nullopt;
}

std::optional<Sample> PlacementQueue::next_at_end() {
  while (!queue_.empty()) {
    if (place_front()) return take_front();
    give_up_front();
  }
  return std::nullopt;
}

}  // namespace field_ros
