// The sites of the field: a regular lattice in the map frame, bounded or wrapped around a torus.
#pragma once

#include <Eigen/Core>
#include <array>

namespace gmrf_slap {

/// One row of the observation matrix H: the field at a place as a combination of a few sites. The
/// nearest site alone (the paper, eq. 4), or the four around it (bilinear, the finite elements of
/// the SPDE link). Weights sum to 1; unused entries have weight 0 and site 0.
struct SiteRow {
  int count = 0;
  std::array<int, 4> site{};
  std::array<double, 4> weight{};

  double dot(const Eigen::VectorXd& site_values) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      sum += weight[i] * site_values[site[i]];
    }
    return sum;
  }
};

enum class Interpolation { nearest, bilinear };

/// nx x ny sites; site i + j nx is at origin + spacing (i, j). Each site stands for the square of
/// side `spacing` around it; the domain is their union. On a torus opposite edges are neighbours
/// for the field, so that it looks the same everywhere; robots stay inside the rectangle even then.
/// All functions O(1).
class Lattice {
 public:
  /// @throws ParameterError if the spacing is not positive, there is no site, or a torus has fewer
  /// than 3 sites along an axis (a site would be its own neighbour)
  Lattice(const Eigen::Vector2d& origin, double spacing, int nx, int ny, bool wrap);

  int sites() const { return nx_ * ny_; }
  int nx() const { return nx_; }
  int ny() const { return ny_; }
  bool wrap() const { return wrap_; }
  double spacing() const { return spacing_; }
  const Eigen::Vector2d& origin() const { return origin_; }

  int site(int i, int j) const { return i + j * nx_; }
  Eigen::Vector2d position(int site) const {
    return origin_ + spacing_ * Eigen::Vector2d(site % nx_, site / nx_);
  }
  /// Whether a point is in the rectangle of the domain; false if it is not finite.
  bool contains(const Eigen::Vector2d& point) const;
  /// The site whose square holds the point; outside of a bounded lattice the nearest one.
  int nearest(const Eigen::Vector2d& point) const;
  /// Outside of a bounded lattice: that of the nearest point inside.
  SiteRow row(const Eigen::Vector2d& point, Interpolation interpolation) const;

 private:
  /// Point in lattice units, clamped (bounded) or wrapped to [0, n) (torus).
  Eigen::Vector2d coordinates(const Eigen::Vector2d& point) const;

  Eigen::Vector2d origin_;
  double spacing_;
  int nx_, ny_;
  bool wrap_;
};

}  // namespace gmrf_slap
