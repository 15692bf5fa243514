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

}  // namespace vector_field_slam
