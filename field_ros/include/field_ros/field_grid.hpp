// A regular grid over the estimator's map region.
#pragma once

#include <Eigen/Core>

#include "field_core/estimator.hpp"

namespace field_ros {

/// Cells of a fixed size that cover a region; row-major like nav_msgs/OccupancyGrid.
struct FieldGrid {
  double x_min = 0.0, y_min = 0.0;  ///< outer corner of cell (0, 0) [m]
  double resolution = 1.0;          ///< [m]
  int width = 1, height = 1;        ///< cells along x and y

  static FieldGrid cover(const field_core::MapRegion& region, double resolution);
  /// Centres of the cells, 2 x (width * height): cell (column i, row j) is column i + j * width.
  Eigen::Matrix2Xd centres() const;
};

/// Largest number of cells that nodes and replays draw.
constexpr double kLargestGrid = 4e6;

}  // namespace field_ros
