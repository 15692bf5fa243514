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

/// Local information with the ring marginalized out; upper triangle, variable i at row_of[i].
template <class S, int M, class Map, int MaxRings>
void Eseif<S, M, Map, MaxRings>::local_information(S* a, const int* row_of) {
  state_.gather(a, row_of);
  for (int i = 0; i < kNodes; ++i) {
    for (int j = i; j < kNodes; ++j) {
      const int p = row_of[i], q = row_of[j];
      a[p < q ? p * kLocal + q : q * kLocal + p] -= window_.taken(i, j);
    }
  }
}

/// What is kept of the robot's dependence on the map in the next cell.
///
/// shared_nodes: p(x, c | nodes of both cells). Of all distributions in which the robot shares
/// information with those nodes only, p(x, c | shared) p(map) is the closest to the one before (in
/// Kullback-Leibler divergence), and its marginals over robot and shared nodes, and over the map,
/// are unchanged: nothing to tune. blank: eq. (42).
template <class S, int M, class Map, int MaxRings>
bool Eseif<S, M, Map, MaxRings>::conditional(GridIndex cell, Conditional& result) {
  for (auto& row : result.cross) {
    for (S& x : row) x = S(0);
  }
  if (config_.relocation == Relocation::blank) {
    S prior[kRobot * kRobot];
    for (int i = 0; i < kRobot * kRobot; ++i) prior[i] = covariance_[i];
    for (int i = 0; i < kRobot; ++i) prior[i * kRobot + i] += config_.relocation_variance[i];
    return dense::invert<S, kRobot>(prior, result.information);
  }
  int row_of[kLocal], place[4], left = 0, row = 0;
  for (int pass = 0; pass < 2; ++pass) {  // nodes that are left behind first, then the shared ones
    for (int j = 0; j < 4; ++j) {
      const GridIndex node = cell_node(state_.cell, j);
      const int dx = node.x - cell.x, dy = node.y - cell.y;
      const bool shared = (dx == 0 || dx == 1) && (dy == 0 || dy == 1);
      if (shared != (pass == 1)) continue;
      place[j] = shared ? 2 * dy + dx : -1;
      for (int i = 0; i < M; ++i) row_of[j * M + i] = row++;
    }
    if (pass == 0) left = row;
  }
  for (int i = kNodes; i < kLocal; ++i) row_of[i] = i;
  local_information(matrix_, row_of);
  if (!dense::eliminate(matrix_, kLocal, kLocal, left)) return false;
  for (int r = 0; r < kRobot; ++r) {
    for (int c = r; c < kRobot; ++c) {
      result.information[r * kRobot + c] = result.information[c * kRobot + r] =
          matrix_[(kNodes + r) * kLocal + kNodes + c];
    }
    for (int j = 0; j < 4; ++j) {
      for (int i = 0; i < M && place[j] >= 0; ++i) {
        result.cross[r][place[j] * M + i] = matrix_[row_of[j * M + i] * kLocal + kNodes + r];
      }
    }
  }
  return true;
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

/// Its opposite: multiplies the map by the robot's conditional, eq. (34)-(35) with F_M and R_x in
/// terms of the information; eq. (41) if the conditional has no cross terms.
template <class S, int M, class Map, int MaxRings>
bool Eseif<S, M, Map, MaxRings>::attach(const Conditional& robot) {
  S full[kRobot * kRobot], inverse[kRobot * kRobot], product[kRobot][kNodes];
  for (int i = 0; i < kRobot * kRobot; ++i) full[i] = robot.information[i];
  if (!dense::invert<S, kRobot>(full, inverse)) return false;
  for (int r = 0; r < kRobot; ++r) {
    for (int i = 0; i < kNodes; ++i) {
      state_.cross[r][i] = robot.cross[r][i];
      product[r][i] = S(0);
      for (int k = 0; k < kRobot; ++k) product[r][i] += inverse[r * kRobot + k] * robot.cross[k][i];
    }
  }
  state_.set_robot_information(robot.information);
  state_.add_products(state_.cross, product, kRobot, S(1));
  return true;
}

/// Eq. (14) and (44): the new node's information enters as an independent prior (the exact one
/// would join the far node to it and break the pattern).
template <class S, int M, class Map, int MaxRings>
bool Eseif<S, M, Map, MaxRings>::add_node(GridIndex index, ExtrapolationSource source,
                                          const S* unknown_values) {
  S covariance[M * M] = {}, information[M * M], mean[M];
  if (source.near < 0) {
    for (int i = 0; i < M; ++i) {
      mean[i] = unknown_values[i];
      covariance[i * M + i] = config_.prior_variance[i];
    }
  } else {
    S far[M * M], near[M * M];
    if (!node_covariance<S, M>(state_.map, source.far, window_.scratch(), far)) return false;
    if (!node_covariance<S, M>(state_.map, source.near, window_.scratch(), near)) return false;
    config_.extrapolation.extrapolate(state_.map.node(source.far).mean,
                                      state_.map.node(source.near).mean, mean);
    extrapolated_covariance<S, M>(config_.extrapolation.e, far, near,
                                  config_.extrapolation_variance, covariance);
  }
  if (!dense::invert<S, M>(covariance, information)) return false;
  auto& node = state_.map.node(state_.map.add(index));
  for (int i = 0; i < M; ++i) {
    node.mean[i] = mean[i];
    for (int j = i; j < M; ++j) node.information[packed(M, i, j)] = information[i * M + j];
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
  Conditional robot;
  if (!conditional(cell, robot) || !detach()) return EseifOutcome::not_positive;
  window_.expand(state_);
  const auto find = [this](GridIndex i) { return state_.map.find(i); };
  for (int added = 0; added < missing; ++added) {
    const NewNode next = next_new_node(cell, find);
    if (!add_node(next.index, next.source, unknown_values)) return EseifOutcome::not_positive;
  }
  state_.cell = cell;
  for (int j = 0; j < 4; ++j) state_.active[j] = state_.map.find(cell_node(cell, j));
  connect_cell();
  report.new_cell = true;
  report.new_nodes = missing;
  const bool good = attach(robot) && window_.condense(state_, config_.rings) && recover();
  return good ? EseifOutcome::applied : EseifOutcome::not_positive;
}

}  // namespace vector_field_slam
