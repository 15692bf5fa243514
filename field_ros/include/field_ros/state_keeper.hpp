// A session's state across the life of its process: loaded at the start, saved now and then.
#pragma once

#include <field_msgs/EstimatorState.h>

#include <chrono>
#include <future>
#include <string>

#include "field_ros/session.hpp"

namespace field_ros {

class StateKeeper {
 public:
  using Clock = std::chrono::steady_clock;

  /// Loads what `resume` and `load_state` ask for, and scatters if `start_anywhere` does and the
  /// node does not resume. @throws DataError naming the file: a node does not start with less than
  /// it was told
  explicit StateKeeper(Session& session);
  StateKeeper(const StateKeeper&) = delete;
  StateKeeper& operator=(const StateKeeper&) = delete;
  /// Waits for a saving that is under way.
  ~StateKeeper();

  /// Starts a saving if save_period has passed and the estimator has learned since the last one.
  /// The state is copied now and written by another thread: a slow disk does not hold up the pose.
  void tick(Clock::time_point now);
  /// Saves what the last saving does not hold yet, if save_period is not 0; returns when it is on
  /// the disk.
  void finish();

  /// Text of the last saving's error; "" if it succeeded or none was made.
  const std::string& problem() const { return problem_; }
  std::uint64_t saved() const { return saved_; }

 private:
  void load(const std::string& name);
  void collect(bool wait);
  void save_in_background();
  bool learned() const { return session_.applied() != applied_at_save_; }

  Session& session_;
  Clock::time_point last_;
  std::uint64_t applied_at_save_ = 0, saved_ = 0;
  std::future<std::string> writing_;
  std::string problem_;
};

}  // namespace field_ros
