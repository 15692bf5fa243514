// Eseif: entering another cell (Algorithm 1's else branch).
#pragma once

#include "vector_field_slam/eseif.hpp"

namespace vector_field_slam {

template <class S, int M, class Map, int MaxRings>
void Eseif<S, M, Map, MaxRings>::connect_cell() {
  state_.map.connect(state_.active[0], 0);
  state_.map.connect(state_.active[0], 1);
  state_.map.connect(state_.active[0], 2);
  state_.map.connect(state_.active[1], 3);
  state_.map.connect(state_.active[1], 1);
  state_.map.connect(state_.active[2], 0);
}

/// Marginalization of pose and calibration, eq. (31)-(32).
template <class S, int M, class Map, int MaxRings>
bool Eseif<S, M, Map, MaxRings>::detach() {
  S full[kRobot * kRobot], inverse[kRobot * kRobot], product[kRobot][kNodes];
  state_.robot_information(full);
  if (!dense::invert<S, kRobot>(full, inverse)) return false;
  for (int r = 0; r < kRobot; ++r) {
    for (int i = 0; i < kNodes; ++i) {
      product[r][i] = S(0);
      for (int k = 0; k < kRobot; ++k)
        product[r][i] += inverse[r * kRobot + k] * state_.cross[k][i];
    }
  }
  state_.add_products(state_.cross, product, kRobot, S(-1));
  return true;
}

/// A new node with its mean, eq. (14), and the information of eq. (13).
template <class S, int M, class Map, int MaxRings>
void Eseif<S, M, Map, MaxRings>::add_node(const NewNode& added, const S* unknown_values) {
  auto& node = state_.map.node(state_.map.add(added.index));
  for (int i = 0; i < M; ++i) {
    node.mean[i] = unknown_values[i];
    node.information[packed(M, i, i)] = S(1) / config_.prior_variance[i];
  }
  if (added.source.near < 0) return;
  config_.extrapolation.extrapolate(state_.map.node(added.source.far).mean,
                                    state_.map.node(added.source.near).mean, node.mean);
}

/// Eq. (14) and (44): adds the new node's information as an independent prior (the exact one would
/// join the far node to it and break the pattern). That of eq. (13) stays in it: without it the
/// variance, which grows fivefold per extrapolation, would have no bound on a way that is never
/// measured well.
template <class S, int M, class Map, int MaxRings>
bool Eseif<S, M, Map, MaxRings>::add_independent(const NewNode& added) {
  if (added.source.near < 0) return true;
  S far[M * M], near[M * M], covariance[M * M], information[M * M];
  if (!node_covariance<S, M>(state_.map, added.source.far, window_.scratch(), far)) return false;
  if (!node_covariance<S, M>(state_.map, added.source.near, window_.scratch(), near)) return false;
  extrapolated_covariance<S, M>(config_.extrapolation.e, far, near, config_.extrapolation_variance,
                                covariance);
  if (!dense::invert<S, M>(covariance, information)) return false;
  auto& node = state_.map.node(state_.map.find(added.index));
  for (int i = 0; i < M; ++i) {
    for (int j = i; j < M; ++j) node.information[packed(M, i, j)] += information[i * M + j];
  }
  return true;
}

/// @param unknown_values of a new node that no two known nodes are in line with
template <class S, int M, class Map, int MaxRings>
EseifOutcome Eseif<S, M, Map, MaxRings>::enter(GridIndex cell, const S* unknown_values,
                                               Report& report) {
  int missing = 0, edges = 0;
  for (int j = 0; j < 4; ++j) {
    const int n = state_.map.find(cell_node(cell, j));
    missing += n < 0;
    // Edges of this cell: 3 from node 0, 2 from node 1, 1 from node 2; some exist already.
    constexpr int kDirections[4][3] = {{0, 1, 2}, {3, 1, -1}, {0, -1, -1}, {-1, -1, -1}};
    for (int d : kDirections[j]) {
      edges += d >= 0 && (n < 0 || state_.map.node(n).edge[d] == Map::kNoEdge);
    }
  }
  if (!state_.map.has_room(missing, edges)) return EseifOutcome::map_full;
  window_.expand(state_);
  const auto find = [this](GridIndex i) { return state_.map.find(i); };
  NewNode added[4];
  for (int k = 0; k < missing; ++k) {
    added[k] = next_new_node(cell, find);
    add_node(added[k], unknown_values);
  }
  Joint joint;
  bool good = true;
  if (config_.relocation == Relocation::window && fits_window(cell, added, missing)) {
    good = window_joint(cell, added, missing, joint) && condition(joint) && detach();
  } else {
    const bool blank = config_.relocation == Relocation::blank;
    good = (blank ? blank_joint(joint) : shared_joint(cell, joint)) && condition(joint) && detach();
    for (int k = 0; good && k < missing; ++k) {
      good = add_independent(added[k]);
    }
  }
  if (!good) return EseifOutcome::not_positive;
  state_.cell = cell;
  for (int j = 0; j < 4; ++j) state_.active[j] = state_.map.find(cell_node(cell, j));
  connect_cell();
  attach(joint);
  report.new_cell = true;
  report.new_nodes = missing;
  good = window_.condense(state_, config_.rings) && recover();
  return good ? EseifOutcome::applied : EseifOutcome::not_positive;
}

}  // namespace vector_field_slam
