// The regular grid of nodes (paper section II): where cells and nodes lie. Which nodes exist, and
// what is known of them, is the business of the solvers.
//
// The headers of the model (grid, bilinear, sensor_model, odometry_step, node_extrapolation,
// linear_start) and of the embedded filter (eseif_*) use the C++17 language and <cmath> only: no
// heap, no exceptions, no Eigen; S is float or double.
#pragma once

#include <cmath>
#include <cstdint>

namespace vector_field_slam {

/// Index of a node; also of the cell whose lower left node it is.
struct GridIndex {
  std::int16_t x = 0, y = 0;
  friend bool operator==(GridIndex a, GridIndex b) { return a.x == b.x && a.y == b.y; }
  friend bool operator!=(GridIndex a, GridIndex b) { return !(a == b); }
};

/// Index of a neighbour; the step is small.
inline GridIndex offset(GridIndex i, int dx, int dy) {
  return {static_cast<std::int16_t>(i.x + dx), static_cast<std::int16_t>(i.y + dy)};
}

/// Node j = 0..3 of a cell in the order of the paper's Fig. 2: lower left, lower right, upper left,
/// upper right.
inline GridIndex cell_node(GridIndex cell, int j) { return offset(cell, j & 1, j >> 1); }

/// Placement of the grid in the map frame.
template <class S>
struct GridGeometry {
  S cell_size = S(1);                  ///< [m], > 0
  S origin_x = S(0), origin_y = S(0);  ///< node (0, 0) [m]

  S node_x(GridIndex i) const { return origin_x + cell_size * S(i.x); }
  S node_y(GridIndex i) const { return origin_y + cell_size * S(i.y); }

  /// The cell that contains a place; a place on an edge belongs to the cell above or right of it.
  /// @return false, and no cell, for a place that is not finite or beyond index +-kLargestIndex
  bool cell_of(S x, S y, GridIndex& cell) const {
    const S u = std::floor((x - origin_x) / cell_size), v = std::floor((y - origin_y) / cell_size);
    const S largest = S(kLargestIndex);
    if (!(u >= -largest && u <= largest && v >= -largest && v <= largest)) return false;
    cell = {static_cast<std::int16_t>(u), static_cast<std::int16_t>(v)};
    return true;
  }

  /// With the start in the middle of a cell: noise of the first poses then changes no cell.
  static GridGeometry around(S x, S y, S cell_size) {
    return {cell_size, x - cell_size / S(2), y - cell_size / S(2)};
  }

  static constexpr int kLargestIndex = 30000;  ///< indices and those of neighbours fit 16 bits
};

}  // namespace vector_field_slam
