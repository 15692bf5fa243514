// Measurements until tf knows where their sensors sit on the robot: pure, without a ROS node.
//
// At the start of a node its first measurements often overtake the static transforms, and a moving
// mount's transform comes a little after its measurement. Such a measurement waits, and with it all
// that arrive later, so that their order stays; it is given up once odometry is `patience` past
// its stamp. A frame that was given up once does not hold up others again until tf knows it.
#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <set>
#include <string>

#include "field_core/estimator.hpp"
#include "field_ros/drop_reason.hpp"

namespace field_ros {

/// Pose of a sensor's frame in the base at a time; nullopt: tf does not know it.
using SensorPlacement = std::function<std::optional<field_core::SE2>(const std::string& frame,
                                                                     field_core::Stamp stamp)>;

class PlacementQueue {
 public:
  using OnDrop = std::function<void(DropReason)>;

  /// @param most measurements that may wait; then the oldest is given up
  PlacementQueue(SensorPlacement placement, field_core::Stamp patience, std::size_t most,
                 OnDrop on_drop);

  /// @param frame of the sensor; empty: the sample stays at the base
  void add(field_core::Sample sample, std::string frame);

  /// The next measurement that is placed. @param now stamp of the newest odometry; nullopt: none
  /// yet, everything waits
  std::optional<field_core::Sample> next(std::optional<field_core::Stamp> now);

  /// Nothing will follow: gives up what tf does not know.
  std::optional<field_core::Sample> next_at_end();

  std::size_t size() const { return queue_.size(); }
  void clear() { queue_.clear(); }

 private:
  struct Waiting {
    field_core::Sample sample;
    std::string frame;
  };

  /// True if the front is placed.
  bool place_front();
  void give_up_front();
  field_core::Sample take_front();

  SensorPlacement placement_;
  field_core::Stamp patience_;
  std::size_t most_;
  OnDrop on_drop_;
  std::deque<Waiting> queue_;
  std::set<std::string> missing_;
};

}  // namespace field_ros
