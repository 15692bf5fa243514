#include "field_ros/lost_monitor.hpp"

#include <algorithm>

namespace field_ros {

LostMonitor::LostMonitor(std::size_t window) : window_(std::max<std::size_t>(1, window)) {}

void LostMonitor::add(const field_core::UpdateResult& result, double threshold) {
  if (!result.applied || result.nis_dof <= 0) return;
  window_[next_] = {result.nis, result.nis_dof};
  next_ = (next_ + 1) % window_.size();
  count_ = std::min(count_ + 1, window_.size());
  if (count_ < window_.size()) return;
  const double now = ratio();
  if (now > threshold) lost_ = true;
  if (now < 0.5 * threshold) lost_ = false;
}

double LostMonitor::ratio() const {
  double nis = 0.0;
  int dof = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    nis += window_[i].nis;
    dof += window_[i].dof;
  }
  return dof > 0 ? nis / dof : 0.0;
}

void LostMonitor::clear() {
  next_ = count_ = 0;
  lost_ = false;
}

}  // namespace field_ros
