// The map of the information filter: nodes, and the information that neighbouring nodes share.
#pragma once

#include <cstdint>

#include "vector_field_slam/grid.hpp"

namespace vector_field_slam {

/// The four neighbours with which a node owns the shared block; the other four own theirs with it.
constexpr int kForward = 4;
constexpr int kForwardSteps[kForward][2] = {{1, 0}, {0, 1}, {1, 1}, {-1, 1}};

/// Direction of kForwardSteps from a to b, -1: b is no forward neighbour.
inline int forward_direction(GridIndex a, GridIndex b) {
  for (int d = 0; d < kForward; ++d) {
    if (offset(a, kForwardSteps[d][0], kForwardSteps[d][1]) == b) return d;
  }
  return -1;
}

/// Number of the upper-triangle entry (i, j), i <= j, of a symmetric n x n matrix.
constexpr int packed(int n, int i, int j) { return i * n - i * (i - 1) / 2 + (j - i); }

/// One node: M values with their share of the information matrix and vector.
template <class S, int M, class EdgeNumber>
struct EseifNode {
  S mean[M];
  /// Residual eta - Lambda mu of the node's rows: what mean recovery has not yet worked off. The
  /// filter keeps it instead of eta of eq. (15): the same information, without the cancellation.
  S residual[M];
  S information[M * (M + 1) / 2];  ///< diagonal block of Lambda, packed upper triangle
  EdgeNumber edge[kForward];       ///< numbers of the shared blocks, kNoEdge: none
  GridIndex index;
};

/// Map of fixed capacity: no heap. Searching is linear, which for tens of nodes beats hashing.
/// A full rectangle of a x b nodes has 4ab - 3a - 3b + 2 edges: 131 for the paper's 7 x 6.
template <class S, int M, int MaxNodes, int MaxEdges>
class FixedMap {
 public:
  using EdgeNumber = std::uint8_t;
  using Node = EseifNode<S, M, EdgeNumber>;
  static constexpr EdgeNumber kNoEdge = 255;
  static_assert(MaxNodes <= 255 && MaxEdges <= 255, "numbers are 8 bits");

  int size() const { return size_; }
  Node& node(int i) { return nodes_[i]; }
  const Node& node(int i) const { return nodes_[i]; }
  /// Block of Lambda, M x M row-major: rows of the node that owns the edge.
  S* edge(EdgeNumber i) { return edges_[i]; }
  const S* edge(EdgeNumber i) const { return edges_[i]; }

  /// Number of the node there, -1: none.
  int find(GridIndex index) const {
    for (int i = 0; i < size_; ++i) {
      if (nodes_[i].index == index) return i;
    }
    return -1;
  }
  /// Room for that many more nodes and edges?
  bool has_room(int nodes, int edges) const {
    return size_ + nodes <= MaxNodes && edge_count_ + edges <= MaxEdges;
  }
  /// A new node, all zero; has_room() first. @return its number
  int add(GridIndex index) {
    nodes_[size_] = Node{};
    nodes_[size_].index = index;
    for (auto& e : nodes_[size_].edge) e = kNoEdge;
    return size_++;
  }
  /// The block that the node shares with its forward neighbour, zero if it is new.
  void connect(int node, int direction) {
    auto& e = nodes_[node].edge[direction];
    if (e != kNoEdge) return;
    for (S& x : edges_[edge_count_]) x = S(0);
    e = static_cast<EdgeNumber>(edge_count_++);
  }
  void clear() { size_ = edge_count_ = 0; }

 private:
  Node nodes_[MaxNodes];
  S edges_[MaxEdges][M * M];
  std::uint8_t size_ = 0, edge_count_ = 0;
};

}  // namespace vector_field_slam
