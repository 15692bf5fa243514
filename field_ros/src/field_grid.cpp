#include "field_ros/field_grid.hpp"

#include <algorithm>
#include <cmath>

namespace field_ros {

FieldGrid FieldGrid::cover(const field_core::MapRegion& region, double resolution) {
  // A region of 10 m at 0.1 m has 100 cells although 10 / 0.1 may round above 100.
  const auto cells = [resolution](double length) {
    return std::max(1, static_cast<int>(std::ceil(length / resolution - 1e-9)));
  };
  FieldGrid grid;
  grid.x_min = region.x_min;
  grid.y_min = region.y_min;
  grid.resolution = resolution;
  grid.width = cells(region.x_max - region.x_min);
  grid.height = cells(region.y_max - region.y_min);
  return grid;
}

Eigen::Matrix2Xd FieldGrid::centres() const {
  Eigen::Matrix2Xd points(2, static_cast<Eigen::Index>(width) * height);
  for (int j = 0; j < height; ++j) {
    for (int i = 0; i < width; ++i) {
      points.col(static_cast<Eigen::Index>(j) * width + i) << x_min + (i + 0.5) * resolution,
          y_min + (j + 0.5) * resolution;
    }
  }
  return points;
}

}  // namespace field_ros
