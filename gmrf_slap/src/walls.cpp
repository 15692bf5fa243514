#include "gmrf_slap/walls.hpp"

namespace gmrf_slap {
namespace {

/// Whether a wall cuts an edge between sites of the row, which are corners of one cell.
bool cell_is_cut(const Walls& walls, const Lattice& lattice, const SiteRow& row) {
  const auto cut = [&](int a, int b) {
    const bool along_x = a / lattice.nx() == b / lattice.nx();
    return (along_x ? walls.right : walls.up)[static_cast<std::size_t>(a)] != 0;
  };
  // Lattice::row names them in the order (0, 0), (1, 0), (0, 1), (1, 1), less those of weight 0.
  const auto& s = row.site;
  if (row.count == 2) return cut(s[0], s[1]);
  return row.count == 4 &&
         (cut(s[0], s[1]) || cut(s[2], s[3]) || cut(s[0], s[2]) || cut(s[1], s[3]));
}

}  // namespace

Walls walls_from(const Lattice& lattice, const field_core::OccupancyMask& mask) {
  Walls walls;
  walls.mask = std::make_shared<const field_core::OccupancyMask>(mask);
  const auto n = static_cast<std::size_t>(lattice.sites());
  walls.right.resize(n);
  walls.up.resize(n);
  const double d = lattice.spacing();
  for (int s = 0; s < lattice.sites(); ++s) {
    const Eigen::Vector2d from = lattice.position(s);
    walls.right[static_cast<std::size_t>(s)] = mask.blocks(from, from + Eigen::Vector2d(d, 0.0));
    walls.up[static_cast<std::size_t>(s)] = mask.blocks(from, from + Eigen::Vector2d(0.0, d));
  }
  return walls;
}

SiteRow row_within(const Walls& walls, const Lattice& lattice, const Eigen::Vector2d& point,
                   Interpolation interpolation) {
  const SiteRow row = lattice.row(point, interpolation);
  if (!walls.mask || !cell_is_cut(walls, lattice, row)) return row;
  SiteRow seen;
  double sum = 0.0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(row.count); ++i) {
    if (walls.mask->blocks(point, lattice.position(row.site[i]))) continue;
    const auto at = static_cast<std::size_t>(seen.count++);
    seen.site[at] = row.site[i];
    seen.weight[at] = row.weight[i];
    sum += row.weight[i];
  }
  if (seen.count == 0) return lattice.row(point, Interpolation::nearest);
  for (double& weight : seen.weight) weight /= sum;
  return seen;
}

}  // namespace gmrf_slap
