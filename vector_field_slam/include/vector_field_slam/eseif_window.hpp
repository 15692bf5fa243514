// The rings of nodes around the current cell, eliminated once per visit.
//
// Mean recovery (eq. 39) over the cell alone leaves the nodes around it behind; over rings of nodes
// around it, it would cost a system of 69 variables in each step. But while the robot stays in the
// cell, nothing outside the cell changes except by way of the four active nodes. So the ring is
// eliminated (a Schur complement) when the cell is entered, each step solves for the 4 M + 5 local
// variables as in the paper, and the ring's means follow when the cell is left: the same result as
// recovering everything in every step, at the paper's cost per step.
#pragma once

#include "vector_field_slam/eseif_state.hpp"

namespace vector_field_slam {

/// A cache: all of it follows from the state at the time the cell was entered.
template <class S, int M, class Map, int MaxRings>
class EseifWindow {
 public:
  using State = EseifState<S, M, Map>;
  static constexpr int kNodes = State::kNodes;
  static constexpr int kWidth = 2 + 2 * MaxRings;
  static constexpr int kMostRing = kWidth * kWidth - 4;
  static constexpr int kMostMembers = kWidth * kWidth > 8 ? kWidth* kWidth : 8;
  /// Of window and robot, and of a node and its neighbours.
  static constexpr int kMostVariables =
      kMostMembers * M + kRobot > 9 * M ? kMostMembers* M + kRobot : 9 * M;

  /// Eliminates the rings around state.cell: the residuals of the active nodes become those of the
  /// condensed system. O((ring M)^3). @return false if the information is not positive definite
  bool condense(State& state, int rings) {
    rings_ = rings < MaxRings ? rings : MaxRings;
    find_nodes(state);
    assemble(state);
    const int n = count_ * M;
    if (!dense::eliminate(u_, n, n, n)) return false;
    dense::forward(u_, n, n, w_[0], kNodes, kNodes);
    dense::forward(u_, n, n, y_);
    sum_products();
    state.subtract_from_residuals(w_, y_, n);
    for (S& d : state.drift) d = S(0);
    return true;
  }

  /// The opposite, with the active nodes where they are now: moves the ring's means, and hands what
  /// that changes on to the residuals of the nodes beyond.
  void expand(State& state) {
    const int n = count_ * M;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < kNodes; ++j) y_[i] -= w_[i][j] * state.drift[j];
    }
    dense::backward(u_, n, n, y_);
    for (int r = 0; r < count_; ++r) {
      auto& node = state.map.node(ring_[r]);
      for (int i = 0; i < M; ++i) {
        node.mean[i] += y_[r * M + i];
        node.residual[i] = S(0);
      }
      push_outwards(state, ring_[r], y_ + r * M);
    }
    if (rings_ == 0) {
      for (int j = 0; j < 4; ++j) push_outwards(state, state.active[j], state.drift + j * M);
    }
  }

  /// What the eliminated ring takes from the information of active values i <= j.
  S taken(int i, int j) const { return s_[i * kNodes + j]; }
  /// Room for a square matrix of kMostVariables, between expand() and condense().
  S* scratch() { return u_; }

  /// The nodes of cell and rings.
  int member_count() const { return count_ + 4; }
  int member(const State& state, int k) const {
    return k < count_ ? ring_[k] : state.active[k - count_];
  }
  bool is_member(const State& state, int node) const {
    return slot(state, state.map.node(node).index) >= 0;
  }

 private:
  /// Place of a node in the window, -1: beyond it.
  int slot(const State& state, GridIndex index) const {
    const int x = index.x - state.cell.x + rings_, y = index.y - state.cell.y + rings_;
    const int width = 2 + 2 * rings_;
    return x >= 0 && x < width && y >= 0 && y < width ? y * width + x : -1;
  }

  void find_nodes(const State& state) {
    const int width = 2 + 2 * rings_;
    count_ = 0;
    for (int s = 0; s < width * width; ++s) {
      const int x = s % width - rings_, y = s / width - rings_;
      place_[s] = -1;
      if ((x == 0 || x == 1) && (y == 0 || y == 1)) {
        place_[s] = static_cast<std::int16_t>(kMostRing + 2 * y + x);  // active
        continue;
      }
      const int node = state.map.find(offset(state.cell, x, y));
      if (node < 0) continue;
      place_[s] = static_cast<std::int16_t>(count_);
      ring_[count_++] = node;
    }
  }

  void assemble(const State& state) {
    const int n = count_ * M;
    for (int i = 0; i < n * n; ++i) u_[i] = S(0);
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < kNodes; ++j) w_[i][j] = S(0);
    }
    for (int r = 0; r < count_; ++r) {
      const auto& node = state.map.node(ring_[r]);
      for (int p = 0; p < M; ++p) {
        y_[r * M + p] = node.residual[p];
        for (int q = p; q < M; ++q) {
          u_[(r * M + p) * n + r * M + q] = node.information[packed(M, p, q)];
        }
      }
      assemble_edges(state, node, r);
    }
    for (int j = 0; j < 4; ++j)
      assemble_edges(state, state.map.node(state.active[j]), kMostRing + j);
  }

  /// The blocks that a node owns with forward neighbours inside the window.
  void assemble_edges(const State& state, const typename Map::Node& node, int a) {
    const int n = count_ * M;
    for (int d = 0; d < kForward; ++d) {
      if (node.edge[d] == Map::kNoEdge) continue;
      const int s = slot(state, offset(node.index, kForwardSteps[d][0], kForwardSteps[d][1]));
      const int b = s < 0 ? -1 : place_[s];
      if (b < 0 || (a >= kMostRing && b >= kMostRing)) continue;
      const S* const block = state.map.edge(node.edge[d]);
      for (int p = 0; p < M; ++p) {
        for (int q = 0; q < M; ++q) {
          const S value = block[p * M + q];
          if (b >= kMostRing) {
            w_[a * M + p][(b - kMostRing) * M + q] = value;
          } else if (a >= kMostRing) {
            w_[b * M + q][(a - kMostRing) * M + p] = value;
          } else if (a < b) {
            u_[(a * M + p) * n + b * M + q] = value;
          } else {
            u_[(b * M + q) * n + a * M + p] = value;
          }
        }
      }
    }
  }

  void sum_products() {
    for (S& x : s_) x = S(0);
    for (int r = 0; r < count_ * M; ++r) {
      for (int i = 0; i < kNodes; ++i) {
        const S f = w_[r][i];
        if (f == S(0)) continue;
        for (int j = i; j < kNodes; ++j) s_[i * kNodes + j] += f * w_[r][j];
      }
    }
  }

  /// Residuals of a node's neighbours beyond the window, after its mean moved by `step`.
  void push_outwards(State& state, int number, const S* step) const {
    const auto& node = state.map.node(number);
    for (int d = 0; d < kForward; ++d) {
      const int dx = kForwardSteps[d][0], dy = kForwardSteps[d][1];
      const GridIndex ahead = offset(node.index, dx, dy), behind = offset(node.index, -dx, -dy);
      if (node.edge[d] != Map::kNoEdge && slot(state, ahead) < 0) {
        auto& other = state.map.node(state.map.find(ahead));
        const S* const block = state.map.edge(node.edge[d]);
        for (int p = 0; p < M; ++p) {
          for (int q = 0; q < M; ++q) other.residual[q] -= block[p * M + q] * step[p];
        }
      }
      if (slot(state, behind) >= 0) continue;
      const int b = state.map.find(behind);
      if (b < 0 || state.map.node(b).edge[d] == Map::kNoEdge) continue;
      auto& other = state.map.node(b);
      const S* const block = state.map.edge(other.edge[d]);
      for (int p = 0; p < M; ++p) {
        for (int q = 0; q < M; ++q) other.residual[p] -= block[p * M + q] * step[q];
      }
    }
  }

  std::int32_t ring_[kMostRing > 0 ? kMostRing : 1];
  std::int16_t place_[kWidth * kWidth];
  int rings_ = 0, count_ = 0;
  S u_[kMostVariables * kMostVariables];           ///< factor of Lambda_rr
  S w_[kMostRing > 0 ? kMostRing* M : 1][kNodes];  ///< U^-T Lambda_ra
  S y_[kMostRing > 0 ? kMostRing* M : 1];          ///< U^-T residual_r
  S s_[kNodes * kNodes];                           ///< Lambda_ar Lambda_rr^-1 Lambda_ra, upper
};

}  // namespace vector_field_slam
