// Walls between the sites of a lattice: the field on one side says nothing of the other.
#pragma once

#include <memory>
#include <vector>

#include "field_core/occupancy_mask.hpp"
#include "gmrf_slap/lattice.hpp"

namespace gmrf_slap {

/// Edges of the lattice's graph that walls cut; empty: none. right[s]: between site s and its
/// neighbour along x, up[s]: along y.
struct Walls {
  std::vector<unsigned char> right, up;
  /// What they were made from, for lines of sight; may be null.
  std::shared_ptr<const field_core::OccupancyMask> mask;
  bool empty() const { return right.empty(); }
  bool operator==(const Walls& other) const { return right == other.right && up == other.up; }
};

/// Edges whose line meets an occupied cell. Complexity O(sites x spacing / resolution).
Walls walls_from(const Lattice& lattice, const field_core::OccupancyMask& mask);

/// Lattice::row with only those sites that can be seen from the point, their weights scaled to sum
/// to 1; if none can, the nearest alone. O(1) where no wall is, else O(spacing / resolution).
SiteRow row_within(const Walls& walls, const Lattice& lattice, const Eigen::Vector2d& point,
                   Interpolation interpolation);

}  // namespace gmrf_slap
