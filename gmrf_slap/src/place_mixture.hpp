// The places of one measurement, gathered from many hypotheses, as one moment matching.
#pragma once

#include <vector>

#include "gmrf_slap/gaussian_field.hpp"

namespace gmrf_slap {

/// Collects weighted rows, joins those that hardly differ, leaves out the lightest, and conditions
/// a field on the measurement. Rows are joined if they are equal (nearest site) or lie in the same
/// quarter by quarter of a cell (bilinear), to their weighted mean.
class PlaceMixture {
 public:
  void clear() { places_.clear(); }
  /// @param residual measurement minus prior mean at the place. Rows without sites are left out:
  /// there is no field outside of the grid.
  void add(const SiteRow& row, double weight, double residual);
  /// Conditions `field` on the measurement. Weights are normalized; the lightest places are left
  /// out as long as together they hold at most `prune_mass`. Returns the mass that was left out.
  /// O(places log places) and field.condition().
  double condition(GaussianField& field, double noise, double prune_mass);

 private:
  struct Place {
    long key;
    int order;
    double weight, residual;
    SiteRow row;
  };
  void join();
  /// Removes the lightest places, in sum at most `mass`; returns what they held.
  double prune(double mass);

  std::vector<Place> places_;
  MixtureUpdate update_;
  std::vector<double> mean_, variance_, sorted_;
  std::vector<SiteRow> rows_;
};

}  // namespace gmrf_slap
