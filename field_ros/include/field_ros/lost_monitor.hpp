// Does the filter still know where the robot is? The verdict from its last innovations.
//
// For a consistent filter the sum of the last n NIS values is chi-square with as many degrees of
// freedom as they have together; real fields are not exactly the model, so the threshold is a ratio
// well above the quantiles of that law (20 scalar readings exceed 2.6 times their degrees of
// freedom once in 10000 windows) rather than a quantile itself.
#pragma once

#include <cstddef>
#include <vector>

#include "field_core/estimator.hpp"

namespace field_ros {

class LostMonitor {
 public:
  /// @param window samples looked at, >= 1
  explicit LostMonitor(std::size_t window);

  /// Takes the NIS of an applied sample into account; one that makes no statement changes nothing.
  /// O(window), no allocation.
  void add(const field_core::UpdateResult& result, double threshold);

  /// True once the full window's NIS per degree of freedom exceeded the threshold, until it falls
  /// below half of it.
  bool lost() const { return lost_; }
  /// NIS per degree of freedom of the window; 0 before the first sample.
  double ratio() const;
  /// The pose is another one: earlier samples say nothing about it.
  void clear();

 private:
  struct Entry {
    double nis = 0.0;
    int dof = 0;
  };
  std::vector<Entry> window_;
  std::size_t next_ = 0, count_ = 0;
  bool lost_ = false;
};

}  // namespace field_ros
