#include "field_core/occupancy_mask.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace field_core {

namespace {

/// In cells, along the mask's own axes.
Eigen::Vector2d coordinates(const OccupancyMask& mask, const Eigen::Vector2d& point) {
  return Eigen::Rotation2Dd(-mask.yaw) * ((point - mask.corner) / mask.resolution);
}

bool occupied_at(const OccupancyMask& mask, const Eigen::Vector2d& cell) {
  const double x = std::floor(cell.x()), y = std::floor(cell.y());
  if (!(x >= 0.0 && y >= 0.0 && x < mask.width && y < mask.height)) return false;
  return mask.occupied[static_cast<std::size_t>(x) +
                       static_cast<std::size_t>(y) * static_cast<std::size_t>(mask.width)] != 0;
}

}  // namespace

bool OccupancyMask::at(const Eigen::Vector2d& point) const {
  return occupied_at(*this, coordinates(*this, point));
}

bool OccupancyMask::blocks(const Eigen::Vector2d& from, const Eigen::Vector2d& to) const {
  const Eigen::Vector2d begin = coordinates(*this, from), way = coordinates(*this, to) - begin;
  const int samples = static_cast<int>(std::ceil(2.0 * way.norm())) + 1;  // half a cell apart
  for (int k = 0; k <= samples; ++k) {
    if (occupied_at(*this, begin + (static_cast<double>(k) / samples) * way)) return true;
  }
  return false;
}

}  // namespace field_core
