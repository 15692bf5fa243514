#include <cmath>

#include "field_core/errors.hpp"
#include "field_core/metrics.hpp"

namespace field_core {
namespace {

double mean_error(const Trajectory& truth, const Trajectory& odometry, double scale) {
  const Trajectory path = dead_reckoning_from_truth(truth, odometry, scale);
  return compare(truth, path, Alignment::none).position.mean;
}

}  // namespace

Trajectory dead_reckoning(const Trajectory& odometry, const SE2& start, double translation_scale) {
  Trajectory path;
  path.reserve(odometry.size());
  for (std::size_t i = 0; i < odometry.size(); ++i) {
    StampedPose pose{odometry[i].stamp, start, std::nullopt};
    if (i > 0) {
      const SE2 step = odometry[i - 1].pose.between(odometry[i].pose);
      pose.pose = path.back().pose *
                  SE2(translation_scale * step.x(), translation_scale * step.y(), step.yaw());
    }
    path.push_back(pose);
  }
  return path;
}

Trajectory dead_reckoning_from_truth(const Trajectory& truth, const Trajectory& odometry,
                                     double translation_scale) {
  Trajectory part;
  if (!truth.empty()) {
    part = between_stamps(odometry, truth.front().stamp, truth.back().stamp);
  }
  if (part.empty()) {
    throw DataError(
        "the stamps of odometry and truth have nothing in common; both must be stamped by the same "
        "clock");
  }
  return dead_reckoning(part, *pose_at(truth, part.front().stamp), translation_scale);
}

double best_translation_scale(const Trajectory& truth, const Trajectory& odometry) {
  const double golden = 0.5 * (std::sqrt(5.0) - 1.0);
  double low = 0.5, high = 2.0;
  double a = high - golden * (high - low), b = low + golden * (high - low);
  double at_a = mean_error(truth, odometry, a), at_b = mean_error(truth, odometry, b);
  while (high - low > 1e-4) {
    if (at_a <= at_b) {
      high = b;
      b = a;
      at_b = at_a;
      a = high - golden * (high - low);
      at_a = mean_error(truth, odometry, a);
    } else {
      low = a;
      a = b;
      at_a = at_b;
      b = low + golden * (high - low);
      at_b = mean_error(truth, odometry, b);
    }
  }
  return 0.5 * (low + high);
}

}  // namespace field_core
