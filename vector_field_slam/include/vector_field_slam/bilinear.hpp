// Bilinear interpolation between the four nodes of a cell (paper eq. 2-6), with derivatives.
#pragma once

#include "vector_field_slam/grid.hpp"

namespace vector_field_slam {

/// Weights of the four nodes (in cell_node order) at one place, and their derivatives by the place.
/// Outside the cell the same polynomials continue.
template <class S>
struct Interpolation {
  GridIndex cell;
  S x, y;    ///< the place, relative to node (0, 0) [m]
  S w[4];    ///< eq. (3)-(6) [1], sum 1
  S w_x[4];  ///< d w / d x [1/m], sum 0
  S w_y[4];  ///< d w / d y [1/m], sum 0

  Interpolation(const GridGeometry<S>& grid, GridIndex cell_index, S place_x, S place_y)
      : cell(cell_index), x(place_x - grid.origin_x), y(place_y - grid.origin_y) {
    const S scale = S(1) / grid.cell_size;
    const S u = x * scale - S(cell.x), v = y * scale - S(cell.y);  // 0..1 inside the cell
    w[0] = (S(1) - u) * (S(1) - v);
    w[1] = u * (S(1) - v);
    w[2] = (S(1) - u) * v;
    w[3] = u * v;
    w_x[1] = scale * (S(1) - v);
    w_x[3] = scale * v;
    w_x[0] = -w_x[1];
    w_x[2] = -w_x[3];
    w_y[2] = scale * (S(1) - u);
    w_y[3] = scale * u;
    w_y[0] = -w_y[2];
    w_y[1] = -w_y[3];
  }
};

}  // namespace vector_field_slam
