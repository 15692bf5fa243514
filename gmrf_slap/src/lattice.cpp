#include "gmrf_slap/lattice.hpp"

#include <algorithm>
#include <cmath>

#include "field_core/errors.hpp"

namespace gmrf_slap {
namespace {

double wrap_to(double value, double period) {
  const double r = value - period * std::floor(value / period);
  return r < period ? r : 0.0;  // rounding can give the period itself
}

}  // namespace

Lattice::Lattice(const Eigen::Vector2d& origin, double spacing, int nx, int ny, bool wrap)
    : origin_(origin), spacing_(spacing), nx_(nx), ny_(ny), wrap_(wrap) {
  using field_core::ParameterError;
  if (!(spacing > 0.0)) throw ParameterError("grid/spacing", "must be > 0");
  if (nx < 1 || ny < 1) throw ParameterError("grid/size", "needs at least one site per axis");
  if (wrap && (nx < 3 || ny < 3)) {
    throw ParameterError("grid/size",
                         "a torus needs at least 3 sites along each axis; set wrap: "
                         "false or enlarge the grid");
  }
}

bool Lattice::contains(const Eigen::Vector2d& point) const {
  if (!point.allFinite()) return false;
  const Eigen::Vector2d p = (point - origin_) / spacing_;
  return p.x() >= -0.5 && p.y() >= -0.5 && p.x() <= nx_ - 0.5 && p.y() <= ny_ - 0.5;
}

Eigen::Vector2d Lattice::coordinates(const Eigen::Vector2d& point) const {
  const Eigen::Vector2d p = (point - origin_) / spacing_;
  if (wrap_) return {wrap_to(p.x(), nx_), wrap_to(p.y(), ny_)};
  return {std::clamp(p.x(), 0.0, nx_ - 1.0), std::clamp(p.y(), 0.0, ny_ - 1.0)};
}

int Lattice::nearest(const Eigen::Vector2d& point) const {
  const Eigen::Vector2d p = coordinates(point);
  const int i = static_cast<int>(std::floor(p.x() + 0.5)) % nx_;
  const int j = static_cast<int>(std::floor(p.y() + 0.5)) % ny_;
  return site(i, j);
}

SiteRow Lattice::row(const Eigen::Vector2d& point, Interpolation interpolation) const {
  SiteRow row;
  if (interpolation == Interpolation::nearest) {
    row.count = 1;
    row.site[0] = nearest(point);
    row.weight[0] = 1.0;
    return row;
  }
  const Eigen::Vector2d p = coordinates(point);
  // On a bounded lattice the last site belongs to the cell before it.
  const int i =
      wrap_ ? static_cast<int>(p.x()) : std::min(static_cast<int>(p.x()), std::max(nx_ - 2, 0));
  const int j =
      wrap_ ? static_cast<int>(p.y()) : std::min(static_cast<int>(p.y()), std::max(ny_ - 2, 0));
  const double u = p.x() - i, v = p.y() - j;
  const int right = nx_ > 1 ? (i + 1) % nx_ : i, up = ny_ > 1 ? (j + 1) % ny_ : j;
  const auto add = [&row](int at, double weight) {
    if (weight == 0.0) return;
    row.site[static_cast<std::size_t>(row.count)] = at;
    row.weight[static_cast<std::size_t>(row.count++)] = weight;
  };
  add(site(i, j), (1.0 - u) * (1.0 - v));
  add(site(right, j), u * (1.0 - v));
  add(site(i, up), (1.0 - u) * v);
  add(site(right, up), u * v);
  return row;
}

}  // namespace gmrf_slap
