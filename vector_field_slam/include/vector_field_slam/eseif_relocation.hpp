// Eseif: what robot and new nodes keep of their dependence on the map when another cell is entered.
//
// Of all distributions in which some variables X (the robot, new nodes) share information with each
// other and with nodes K only, p(X | K) p(map) is the closest to the one before (in
// Kullback-Leibler divergence): it keeps the marginals of (X, K) and of the map, and there is
// nothing to tune.
//   window        X = robot and new nodes, K = all known nodes of the new cell. The pattern stays:
//                 they are the new cell's nodes. The marginal is taken over the window, the old
//                 cell and the rings around it, given all beyond.
//   shared_nodes  X = robot, K = the nodes that both cells share.
//   blank         X = robot, K empty, with R0 added to the robot's covariance: eq. (41)-(42).
#pragma once

#include "vector_field_slam/eseif.hpp"

namespace vector_field_slam {

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

template <class S, int M, class Map, int MaxRings>
bool Eseif<S, M, Map, MaxRings>::blank_joint(Joint& joint) {
  joint = Joint{};
  S prior[kRobot * kRobot], information[kRobot * kRobot];
  for (int i = 0; i < kRobot * kRobot; ++i) prior[i] = covariance_[i];
  for (int i = 0; i < kRobot; ++i) prior[i * kRobot + i] += config_.relocation_variance[i];
  if (!dense::invert<S, kRobot>(prior, information)) return false;
  for (int r = 0; r < kRobot; ++r) {
    for (int c = r; c < kRobot; ++c) {
      joint.a[(kNodes + r) * kLocal + kNodes + c] = information[r * kRobot + c];
    }
  }
  return true;
}

template <class S, int M, class Map, int MaxRings>
bool Eseif<S, M, Map, MaxRings>::shared_joint(GridIndex cell, Joint& joint) {
  joint = Joint{};
  int row_of[kLocal], place[4], left = 0, row = 0;
  for (int pass = 0; pass < 2; ++pass) {  // nodes that are left behind first, then the shared ones
    for (int j = 0; j < 4; ++j) {
      const GridIndex node = cell_node(state_.cell, j);
      const int dx = node.x - cell.x, dy = node.y - cell.y;
      const bool shared = (dx == 0 || dx == 1) && (dy == 0 || dy == 1);
      if (shared != (pass == 1)) continue;
      place[j] = shared ? 2 * dy + dx : -1;
      if (shared) joint.given[place[j]] = true;
      for (int i = 0; i < M; ++i) row_of[j * M + i] = row++;
    }
    if (pass == 0) left = row;
  }
  for (int i = kNodes; i < kLocal; ++i) row_of[i] = i;
  local_information(matrix_, row_of);
  if (!dense::eliminate(matrix_, kLocal, kLocal, left)) return false;
  for (int r = 0; r < kRobot; ++r) {
    for (int c = r; c < kRobot; ++c) {
      joint.a[(kNodes + r) * kLocal + kNodes + c] = matrix_[(kNodes + r) * kLocal + kNodes + c];
    }
    for (int j = 0; j < 4; ++j) {
      for (int i = 0; i < M && place[j] >= 0; ++i) {
        joint.a[(place[j] * M + i) * kLocal + kNodes + r] =
            matrix_[row_of[j * M + i] * kLocal + kNodes + r];
      }
    }
  }
  return true;
}

/// Do the nodes that new ones come from lie in the window, and is there room for all?
template <class S, int M, class Map, int MaxRings>
bool Eseif<S, M, Map, MaxRings>::fits_window(GridIndex cell, const NewNode* added,
                                             int count) const {
  const int members = window_.member_count() + count;
  if (members > window_.kMostMembers) return false;
  const auto inside = [&](int node) {
    if (window_.is_member(state_, node)) return true;
    for (int k = 0; k < count; ++k) {
      if (state_.map.node(node).index == added[k].index) return true;
    }
    return false;
  };
  for (int k = 0; k < count; ++k) {
    if (added[k].source.near < 0 || !inside(added[k].source.near) || !inside(added[k].source.far)) {
      return false;
    }
  }
  for (int j = 0; j < 4; ++j) {
    if (!inside(state_.map.find(cell_node(cell, j)))) return false;
  }
  return true;
}

template <class S, int M, class Map, int MaxRings>
bool Eseif<S, M, Map, MaxRings>::window_joint(GridIndex cell, const NewNode* added, int count,
                                              Joint& joint) {
  joint = Joint{};
  // Those that go first, then the new cell's nodes in their order, then the robot.
  int members[EseifWindow<S, M, Map, MaxRings>::kMostMembers], total = 0;
  const auto in_cell = [&](GridIndex i) {
    return (i.x == cell.x || i.x == cell.x + 1) && (i.y == cell.y || i.y == cell.y + 1);
  };
  for (int k = 0; k < window_.member_count(); ++k) {
    const int node = window_.member(state_, k);
    if (!in_cell(state_.map.node(node).index)) members[total++] = node;
  }
  const int left = total;
  for (int k = 0; k < count; ++k) {  // their information comes with the joint
    auto& node = state_.map.node(state_.map.find(added[k].index));
    for (S& x : node.information) x = S(0);
  }
  for (int j = 0; j < 4; ++j) {
    members[total] = state_.map.find(cell_node(cell, j));
    joint.given[j] = true;
    for (int k = 0; k < count; ++k) {
      if (state_.map.node(members[total]).index == added[k].index) {
        joint.is_new[j] = true;
        joint.given[j] = false;
      }
    }
    ++total;
  }
  const int n = total * M + kRobot;
  S* const a = window_.scratch();
  assemble_members<S, M>(state_.map, members, total, a, n);
  for (int r = 0; r < kRobot; ++r) {
    S* const column = a + total * M + r;
    for (int m = 0; m < total; ++m) {
      for (int j = 0; j < 4; ++j) {
        if (members[m] != state_.active[j]) continue;
        for (int i = 0; i < M; ++i) column[(m * M + i) * n] = state_.cross[r][j * M + i];
      }
    }
    for (int c = 0; c <= r; ++c) {
      column[(total * M + c) * n] = state_.information[packed(kRobot, c, r)];
    }
  }
  for (int k = 0; k < count; ++k) {
    int rows[3] = {-1, -1, -1};
    for (int m = 0; m < total; ++m) {
      if (members[m] == added[k].source.far) rows[0] = m * M;
      if (members[m] == added[k].source.near) rows[1] = m * M;
      if (state_.map.node(members[m]).index == added[k].index) rows[2] = m * M;
    }
    add_extrapolation<S, M>(config_.extrapolation.e, config_.extrapolation_variance, rows, a, n);
  }
  if (!dense::eliminate(a, n, n, left * M)) return false;
  for (int i = 0; i < kLocal; ++i) {
    for (int j = i; j < kLocal; ++j) {
      joint.a[i * kLocal + j] = a[(left * M + i) * n + left * M + j];
    }
  }
  return true;
}

/// From the joint information of X and K to that of p(X | K): the block of K becomes
/// A_KX A_XX^-1 A_XK, the factor of eq. (35).
template <class S, int M, class Map, int MaxRings>
bool Eseif<S, M, Map, MaxRings>::condition(Joint& joint) {
  int order[kLocal], free = 0, total = 0;
  for (int pass = 0; pass < 2; ++pass) {
    for (int j = 0; j < 4; ++j) {
      for (int i = 0; i < M && (pass == 0 ? joint.is_new[j] : joint.given[j]); ++i) {
        order[total++] = j * M + i;
      }
    }
    for (int r = 0; r < kRobot && pass == 0; ++r) order[total++] = kNodes + r;
    if (pass == 0) free = total;
  }
  S* const b = matrix_;
  for (int i = 0; i < total; ++i) {
    for (int j = i; j < total; ++j) {
      const int p = order[i], q = order[j];
      b[i * total + j] = joint.a[p < q ? p * kLocal + q : q * kLocal + p];
    }
  }
  if (!dense::eliminate(b, total, total, free)) return false;
  for (int i = free; i < total; ++i) {
    for (int j = i; j < total; ++j) {
      S sum = S(0);
      for (int k = 0; k < free; ++k) sum += b[k * total + i] * b[k * total + j];
      const int p = order[i], q = order[j];
      joint.a[p < q ? p * kLocal + q : q * kLocal + p] = sum;
    }
  }
  return true;
}

/// Multiplies the map by the conditional: eq. (34)-(35), with F_M and R_x in terms of information;
/// eq. (41) if it depends on no node.
template <class S, int M, class Map, int MaxRings>
void Eseif<S, M, Map, MaxRings>::attach(const Joint& joint) {
  for (int i = 0; i < 4; ++i) {
    S* const own = state_.map.node(state_.active[i]).information;
    for (int p = 0; p < M; ++p) {
      const S* const row = joint.a + (i * M + p) * kLocal;
      for (int q = p; q < M; ++q) own[packed(M, p, q)] += row[i * M + q];
      for (int j = i + 1; j < 4; ++j) {
        S* const block = state_.shared(i, j) + p * M;
        for (int q = 0; q < M; ++q) block[q] += row[j * M + q];
      }
      for (int r = 0; r < kRobot; ++r) state_.cross[r][i * M + p] = row[kNodes + r];
    }
  }
  for (int r = 0; r < kRobot; ++r) {
    for (int c = r; c < kRobot; ++c) {
      state_.information[packed(kRobot, r, c)] = joint.a[(kNodes + r) * kLocal + kNodes + c];
    }
  }
}

}  // namespace vector_field_slam
