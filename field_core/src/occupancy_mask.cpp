#include "field_core/occupancy_mask.hpp"

#include <cmath>

namespace field_core {

bool OccupancyMask::at(const Eigen::Vector2d& point) const {
  const double c = std::cos(yaw), s = std::sin(yaw);
  const Eigen::Vector2d d = (point - corner) / resolution;
  const double x = std::floor(c * d.x() + s * d.y()), y = std::floor(c * d.y() - s * d.x());
  if (!(x >= 0.0 && y >= 0.0 && x < width && y < height)) return false;
  return occupied[static_cast<std::size_t>(x) +
                  static_cast<std::size_t>(y) * static_cast<std::size_t>(width)] != 0;
}

bool OccupancyMask::blocks(const Eigen::Vector2d& from, const Eigen::Vector2d& to) const {
  const double length = (to - from).norm();
  // Half a cell per sample: no cell that the line crosses is missed.
  const int samples = static_cast<int>(std::ceil(2.0 * length / resolution)) + 1;
  for (int k = 0; k <= samples; ++k) {
    if (at(from + (static_cast<double>(k) / samples) * (to - from))) return true;
  }
  return false;
}

}  // namespace field_core
