// Places of a measurement that look alike to the field, as one column of its update.
#pragma once

#include <vector>

#include "gmrf_slap/gaussian_field.hpp"

namespace gmrf_slap {

/// Joins places k with curvatures d_k of one sign to groups of which the field's update knows only
/// D = sum d_k and the mean row a = sum d_k a_k / D (MixtureUpdate). What a group leaves out of
/// Sigma' is E = sum d_k Sigma (a_k - a)^T (a_k - a) Sigma, and as quadratic forms
///
///   0 <= E <= loss Sigma,  loss = sum |d_k| (a_k - a) Sigma (a_k - a)^T:
///
/// whatever is asked of the field, its variance is off by at most this share of what it was before
/// the measurement. Losses of groups add up to a bound for all of them; since their directions
/// differ, all together are off by two to four times the largest loss (see test_place_groups).
class PlaceGroups {
 public:
  struct Place {
    SiteRow row;
    double curvature = 0.0;  ///< d
    double variance = 0.0;   ///< a Sigma a^T
  };

  /// Heaviest first: a place joins the group whose first place it differs from least if the group's
  /// loss stays within `largest_loss`. Groups of negative curvature lose at most `negative_budget`
  /// in sum: that loss makes Sigma' smaller, which has to stay positive. Covariances are asked
  /// of `field`. O(places groups).
  void build(const GaussianField& field, const std::vector<Place>& places, double largest_loss,
             double negative_budget);

  /// Indices of the places, group by group; starts()[i]: the place begins a group.
  const std::vector<int>& order() const { return order_; }
  const std::vector<bool>& starts() const { return starts_; }
  int size() const { return static_cast<int>(groups_.size()); }
  /// Sums over the groups of the last build.
  double positive_loss() const { return positive_loss_; }
  double negative_loss() const { return negative_loss_; }

 private:
  struct Group {
    int first, last;  // places
    double curvature, variance, loss;
    bool negative;
  };
  void sort_by_weight(const std::vector<Place>& places);
  /// -1: none of its sign.
  int closest(const GaussianField& field, const std::vector<Place>& places, const Place& place);
  /// false: it does not fit.
  bool join(const GaussianField& field, const std::vector<Place>& places, Group& group, int k,
            double largest_loss, double negative_budget);
  /// a Sigma a_k^T of a group's mean row and a place.
  double covariance_with(const GaussianField& field, const std::vector<Place>& places,
                         const Group& group, const Place& place) const;

  std::vector<Group> groups_;
  std::vector<SiteRow> leaders_;
  std::vector<int> order_, next_;
  std::vector<bool> starts_;
  std::vector<double> covariance_, weights_;
  double positive_loss_ = 0.0, negative_loss_ = 0.0;
};

}  // namespace gmrf_slap
