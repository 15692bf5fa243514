// The places of one measurement, gathered from many hypotheses, as one moment matching.
#pragma once

#include <vector>

#include "gmrf_slap/gaussian_field.hpp"
#include "place_groups.hpp"

namespace gmrf_slap {

/// How much of a measurement the field's update may leave out.
struct Thrift {
  double prune_mass = 0.0;  ///< of the lightest places
  double merge_loss = 0.0;  ///< of each group of similar places, see PlaceGroups
};

/// What it left out.
struct LeftOut {
  double mass = 0.0;
  /// Loss of the groups in sum, as a share of all that the measurement says about the covariance:
  /// the sum over places of |w (1/s - g^2)| a Sigma a^T.
  double information = 0.0;
};

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
  /// out as long as together they hold at most `prune_mass`; groups are made of the rest, which
  /// changes neither the mean nor, however little noise there is, that Sigma' is positive.
  /// O(places (log places + groups)) and field.condition().
  LeftOut condition(GaussianField& field, double noise, const Thrift& thrift);

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
  /// Groups of the places, their means and variances known; returns the share of information lost.
  double group(const GaussianField& field, double total, double noise, double merge_loss);

  std::vector<Place> places_;
  MixtureUpdate update_;
  PlaceGroups groups_;
  std::vector<PlaceGroups::Place> pieces_;
  std::vector<double> mean_, variance_, sorted_;
  std::vector<SiteRow> rows_;
};

}  // namespace gmrf_slap
