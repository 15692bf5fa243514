// What is occupied by walls, as estimators see it: the content of a nav_msgs/OccupancyGrid.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace field_core {

/// width x height cells, row-major, as nav_msgs/OccupancyGrid has them. Nothing is occupied outside
/// of it. Functions are O(1) and O(length / resolution).
struct OccupancyMask {
  Eigen::Vector2d corner = Eigen::Vector2d::Zero();  ///< of cell (0, 0), in the map frame [m]
  double yaw = 0.0;         ///< of its x axis in the map frame, about that corner [rad]
  double resolution = 1.0;  ///< side of a cell [m]
  int width = 0, height = 0;
  std::vector<unsigned char> occupied;  ///< width x height

  bool at(const Eigen::Vector2d& point) const;
  /// Whether the line between two points meets an occupied cell. A cell of which it cuts off
  /// less than half a side may be missed.
  bool blocks(const Eigen::Vector2d& from, const Eigen::Vector2d& to) const;
};

}  // namespace field_core
