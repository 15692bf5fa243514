// Node numbers by grid index, for maps that grow: open addressing, linear probing.
#pragma once

#include <cstdint>
#include <vector>

#include "vector_field_slam/grid.hpp"

namespace vector_field_slam {

/// Nodes are numbered 0, 1, ... in the order of insertion. find and insert are O(1); insert doubles
/// the table (allocating) now and then.
class NodeTable {
 public:
  NodeTable() { clear(); }
  void clear() {
    slots_.assign(64, kEmpty);
    indices_.clear();
  }
  int size() const { return static_cast<int>(indices_.size()); }
  GridIndex index(int node) const { return indices_[node]; }

  /// Number of the node there, -1: none.
  int find(GridIndex index) const {
    for (std::uint32_t s = hash(index);; ++s) {
      const std::int32_t node = slots_[s & (slots_.size() - 1)];
      if (node == kEmpty) return -1;
      if (indices_[node] == index) return node;
    }
  }
  /// @param index not in the table yet @return its number
  int insert(GridIndex index) {
    if (2 * (indices_.size() + 1) > slots_.size()) grow();
    indices_.push_back(index);
    place(size() - 1);
    return size() - 1;
  }

 private:
  static constexpr std::int32_t kEmpty = -1;
  static std::uint32_t hash(GridIndex i) {
    const std::uint32_t key = (static_cast<std::uint32_t>(static_cast<std::uint16_t>(i.x)) << 16) |
                              static_cast<std::uint16_t>(i.y);
    const std::uint32_t h =
        key * 0x9E3779B1u;  // Fibonacci hashing; the high bits are the good ones
    return h ^ (h >> 15);
  }
  void place(int node) {
    std::uint32_t s = hash(indices_[node]);
    while (slots_[s & (slots_.size() - 1)] != kEmpty) ++s;
    slots_[s & (slots_.size() - 1)] = node;
  }
  void grow() {
    slots_.assign(2 * slots_.size(), kEmpty);
    for (int node = 0; node < size(); ++node) place(node);
  }

  std::vector<GridIndex> indices_;
  std::vector<std::int32_t> slots_;  ///< size a power of two
};

}  // namespace vector_field_slam
