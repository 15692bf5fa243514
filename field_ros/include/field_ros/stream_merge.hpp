// Time-ordered merge of odometry and measurements: pure, without a ROS node.
//
// A measurement waits until odometry brackets its stamp (and until `reorder_window` has passed
// after it); its odometry pose is interpolated there. Out come steps in order of their stamps, each
// with the motion since the step before. Messages that reach the merge in another order, within the
// window, give the same steps.
#pragma once

#include <chrono>
#include <deque>
#include <functional>
#include <optional>

#include "field_core/estimator.hpp"
#include "field_ros/drop_reason.hpp"
#include "field_ros/message_check.hpp"

namespace field_ros {

struct MergeLimits {
  std::size_t odometry = 2000;  ///< odometry messages kept
  std::size_t pending = 1000;   ///< measurements that may wait
  field_core::Stamp reorder_window{0};
  field_core::Stamp time_jump{std::chrono::seconds(1)};
  field_core::Stamp odometry_gap{std::chrono::seconds(10)};
};

/// A measurement with the motion that leads to it.
struct MergedStep {
  field_core::OdometryIncrement increment;
  field_core::Sample sample;
  field_core::SE2 odom_pose;                                ///< odometry at the sample's stamp
  std::optional<field_core::PositionObservation> position;  ///< instead of readings
};

class StreamMerge {
 public:
  using OnDrop = std::function<void(DropReason)>;

  /// @param on_drop called once for each message that is given up
  StreamMerge(const MergeLimits& limits, OnDrop on_drop);

  /// True: the clock went back (two consecutive messages, ordered among themselves, are more than
  /// time_jump behind the newest). Everything older is then forgotten and the estimator must be
  /// reset. A single message far behind, or further ahead than odometry_gap, is dropped. Amortized
  /// O(1).
  bool add_odometry(const OdometrySample& odometry);

  /// O(pending) in the worst case, O(1) for samples in order.
  /// @param position seen at the sample's stamp; the sample has no readings then
  void add_sample(field_core::Sample sample,
                  std::optional<field_core::PositionObservation> position = std::nullopt);

  /// Stamp of what next() would return; gives up what can never be used.
  std::optional<field_core::Stamp> ready_stamp(bool end_of_input = false);

  /// The next step that is ready. @param end_of_input nothing will follow: do not wait for the
  /// window
  std::optional<MergedStep> next(bool end_of_input = false);

  /// Overload: gives up the oldest ready sample as long as one that is more than `most_lag` newer
  /// is ready as well. What next() returns is then at most `most_lag` behind what is known.
  void shed(field_core::Stamp most_lag);

  /// The next increment starts here instead of at the last step: at `stamp` if odometry is known
  /// there, else at the newest. False if there is no odometry at all.
  bool move_anchor(field_core::Stamp stamp);
  void move_anchor_to_newest();

  /// Where the next increment starts: the last step, or the first odometry.
  const std::optional<OdometrySample>& anchor() const { return anchor_; }
  std::optional<OdometrySample> newest_odometry() const;
  std::size_t pending() const { return queue_.size(); }
  void clear();

 private:
  struct Waiting {
    field_core::Sample sample;
    std::optional<field_core::PositionObservation> position;
  };

  /// Odometry interpolated, or the anchor's, which may be older than what the buffer still holds.
  std::optional<field_core::SE2> pose_at(field_core::Stamp stamp) const;
  bool ready(const Waiting& waiting) const;
  bool handle_jump(const OdometrySample& odometry);
  void push_odometry(const OdometrySample& odometry);
  void give_up_candidate();

  MergeLimits limits_;
  OnDrop on_drop_;
  std::deque<OdometrySample> odometry_;
  std::deque<Waiting> queue_;       // ordered by stamp
  std::deque<Waiting> after_jump_;  // arrived while candidate_ may be a restarted clock
  std::optional<OdometrySample>
      candidate_;  // far from the newest: waits for the next to confirm it
  std::optional<OdometrySample> anchor_;
  bool stepped_ = false;
};

}  // namespace field_ros
