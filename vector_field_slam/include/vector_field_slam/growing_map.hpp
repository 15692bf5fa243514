// Map of the information filter for a host: FixedMap's interface, but it grows.
#pragma once

#include <array>
#include <vector>

#include "vector_field_slam/eseif_map.hpp"
#include "vector_field_slam/node_table.hpp"

namespace vector_field_slam {

/// Memory is linear in the nodes. Allocates only when a cell with new nodes is entered, and then by
/// doubling; all else is O(1).
template <class S, int M>
class GrowingMap {
 public:
  using EdgeNumber = std::int32_t;
  using Node = EseifNode<S, M, EdgeNumber>;
  using Block = std::array<S, M * M>;
  static constexpr EdgeNumber kNoEdge = -1;

  void set_capacity(int nodes) { most_nodes_ = nodes; }
  int size() const { return static_cast<int>(nodes_.size()); }
  Node& node(int i) { return nodes_[i]; }
  const Node& node(int i) const { return nodes_[i]; }
  S* edge(EdgeNumber i) { return edges_[i].data(); }
  const S* edge(EdgeNumber i) const { return edges_[i].data(); }
  int edge_count() const { return static_cast<int>(edges_.size()); }
  int find(GridIndex index) const { return table_.find(index); }
  bool has_room(int nodes, int) const { return size() + nodes <= most_nodes_; }

  int add(GridIndex index) {
    nodes_.push_back(Node{});
    nodes_.back().index = index;
    for (auto& e : nodes_.back().edge) e = kNoEdge;
    return table_.insert(index);
  }
  void connect(int node, int direction) {
    auto& e = nodes_[node].edge[direction];
    if (e != kNoEdge) return;
    e = edge_count();
    edges_.push_back(Block{});
  }
  void clear() {
    nodes_.clear();
    edges_.clear();
    table_.clear();
  }

 private:
  std::vector<Node> nodes_;
  std::vector<Block> edges_;
  NodeTable table_;
  int most_nodes_ = 1 << 20;
};

}  // namespace vector_field_slam
