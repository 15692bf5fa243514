// Where the values of a new node come from: eq. (14) and (48).
//
//   m_new = A1 m_far + A2 m_near + e,  A1 = -E,  A2 = I + E,
// where the near node is a neighbour of the new one and the far node lies behind it, twice as far.
// E = I continues the straight line through both, channel by channel. For optical spots E averages
// over the spots, so that the direction between spots is copied from the near node: (48).
// (In print the far node's A1 and the near node's A2 carry j1 and j2 without saying which is near.)
#pragma once

#include "vector_field_slam/sensor_model.hpp"

namespace vector_field_slam {

enum class Extrapolation : std::uint8_t { linear, common };

/// E of eq. (14): linear, the identity; common, the mean over all channels of the same kind.
template <class S, int M>
struct ExtrapolationFactors {
  S e[M][M];

  ExtrapolationFactors(const Channel* channels, Extrapolation rule) {
    for (int i = 0; i < M; ++i) {
      int alike = 0;
      for (int k = 0; k < M; ++k) alike += channels[k].kind == channels[i].kind;
      for (int k = 0; k < M; ++k) {
        const bool common = rule == Extrapolation::common && channels[k].kind == channels[i].kind;
        e[i][k] =
            common ? S(1) / S(alike) : (i == k && rule == Extrapolation::linear ? S(1) : S(0));
      }
    }
  }

  /// A1 m_far + A2 m_near.
  void extrapolate(const S* far, const S* near, S* result) const {
    for (int i = 0; i < M; ++i) {
      result[i] = near[i];
      for (int k = 0; k < M; ++k) result[i] += e[i][k] * (near[k] - far[k]);
    }
  }
};

/// Two known nodes in line with a new one.
struct ExtrapolationSource {
  int near = -1, far = -1;  ///< node numbers; -1: none found
};

/// Searches the eight directions, the four straight ones (whose near node is nearer) first.
/// @param find node number of a GridIndex, -1 if there is no such node
template <class Find>
ExtrapolationSource extrapolation_source(GridIndex node, const Find& find) {
  constexpr int kDirections[8][2] = {{-1, 0},  {1, 0},  {0, -1}, {0, 1},
                                     {-1, -1}, {1, -1}, {-1, 1}, {1, 1}};
  for (const auto& d : kDirections) {
    const int near = find(offset(node, d[0], d[1]));
    if (near < 0) continue;
    const int far = find(offset(node, 2 * d[0], 2 * d[1]));
    if (far >= 0) return {near, far};
  }
  return {};
}

/// A node that a cell needs and the map does not have yet.
struct NewNode {
  GridIndex index;
  ExtrapolationSource source;
};

/// Which of a cell's missing nodes comes next: one with two known nodes in line, if there is any. A
/// corner may get its own only once another node of the cell is there. At least one must be
/// missing.
template <class Find>
NewNode next_new_node(GridIndex cell, const Find& find) {
  NewNode next;
  bool any = false;
  for (int j = 0; j < 4; ++j) {
    const GridIndex index = cell_node(cell, j);
    if (find(index) >= 0) continue;
    const ExtrapolationSource source = extrapolation_source(index, find);
    if (!any || (next.source.near < 0 && source.near >= 0)) next = {index, source};
    any = true;
  }
  return next;
}

/// Values for a new node that no two known nodes are in line with: the field as the readings at the
/// sensor's pose suggest, and for channels without a reading the mean of the nodes around.
/// @param nodes values of four nodes @param values M numbers, set
template <class S, int M>
void suggested_values(const SensorModel<S, M>& model, const GridGeometry<S>& grid,
                      const SensorPose<S>& sensor, const S* offset, const Observation<S>* readings,
                      int count, const S* const* nodes, S* values) {
  S reading[M];
  bool seen[M] = {};
  for (int k = 0; k < count; ++k) {
    reading[readings[k].channel] = readings[k].value;
    seen[readings[k].channel] = true;
  }
  for (int i = 0; i < M; ++i) {
    const int partner = model.channels[i].partner;
    if (seen[i] && (partner < 0 || seen[partner])) {
      values[i] =
          model.field_value(i, sensor, offset, sensor.x - grid.origin_x, sensor.y - grid.origin_y,
                            reading[i], partner < 0 ? S(0) : reading[partner]);
    } else {
      values[i] = S(0.25) * (nodes[0][i] + nodes[1][i] + nodes[2][i] + nodes[3][i]);
    }
  }
}

}  // namespace vector_field_slam
