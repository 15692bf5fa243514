#include "place_groups.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gmrf_slap {
namespace {
// Fields are symmetric on a lattice: what differs by less than this is equal but for rounding, and
// must not group differently in another engine or on another processor.
constexpr double kEqual = 1e-6;
}  // namespace

int PlaceGroups::closest(const GaussianField& field, const std::vector<Place>& places,
                         const Place& place) {
  const bool negative = place.curvature < 0.0;
  field.covariances(place.row, leaders_.data(), size(), covariance_.data());
  int best = -1;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    const double distance =
        places[static_cast<std::size_t>(groups_[g].first)].variance - 2.0 * covariance_[g];
    if (distance < least - kEqual * place.variance && groups_[g].negative == negative) {
      least = distance;
      best = static_cast<int>(g);
    }
  }
  return best;
}

double PlaceGroups::covariance_with(const GaussianField& field, const std::vector<Place>& places,
                                    const Group& group, const Place& place) const {
  double sum = 0.0;
  for (int k = group.first; k >= 0; k = next_[static_cast<std::size_t>(k)]) {
    const Place& member = places[static_cast<std::size_t>(k)];
    double covariance = 0.0;
    field.covariances(place.row, &member.row, 1, &covariance);
    sum += member.curvature * covariance;
  }
  return sum / group.curvature;
}

bool PlaceGroups::join(const GaussianField& field, const std::vector<Place>& places, Group& group,
                       int k, double largest_loss, double negative_budget) {
  const Place& place = places[static_cast<std::size_t>(k)];
  const double cross = covariance_with(field, places, group, place);
  const double sum = group.curvature + place.curvature;
  const double distance = std::max(0.0, place.variance - 2.0 * cross + group.variance);
  const double loss = std::abs(group.curvature * place.curvature / sum) * distance;
  double& total = group.negative ? negative_loss_ : positive_loss_;
  // Not a number (two curvatures of 0) is no join either.
  if (!(group.loss + loss <= largest_loss)) return false;
  if (group.negative && total + loss > negative_budget) return false;
  const double old = group.curvature / sum, fresh = place.curvature / sum;
  group.variance =
      old * old * group.variance + 2.0 * old * fresh * cross + fresh * fresh * place.variance;
  group.curvature = sum;
  group.loss += loss;
  total += loss;
  next_[static_cast<std::size_t>(group.last)] = k;
  group.last = k;
  return true;
}

/// Heaviest first, equal ones as they come.
void PlaceGroups::sort_by_weight(const std::vector<Place>& places) {
  order_.resize(places.size());
  weights_.resize(places.size());
  for (std::size_t k = 0; k < places.size(); ++k) {
    const double weight = std::abs(places[k].curvature) * std::max(places[k].variance, 0.0);
    order_[k] = static_cast<int>(k);
    weights_[k] = std::round(std::log(weight) / kEqual);
  }
  std::sort(order_.begin(), order_.end(), [this](int a, int b) {
    const double of_a = weights_[static_cast<std::size_t>(a)];
    const double of_b = weights_[static_cast<std::size_t>(b)];
    return of_a != of_b ? of_a > of_b : a < b;
  });
}

void PlaceGroups::build(const GaussianField& field, const std::vector<Place>& places,
                        double largest_loss, double negative_budget) {
  const std::size_t count = places.size();
  groups_.clear();
  leaders_.clear();
  next_.assign(count, -1);
  covariance_.resize(std::max(covariance_.size(), count));
  positive_loss_ = negative_loss_ = 0.0;
  sort_by_weight(places);
  for (const int k : order_) {
    const Place& place = places[static_cast<std::size_t>(k)];
    const int at = closest(field, places, place);
    if (at >= 0 && join(field, places, groups_[static_cast<std::size_t>(at)], k, largest_loss,
                        negative_budget)) {
      continue;
    }
    groups_.push_back({k, k, place.curvature, place.variance, 0.0, place.curvature < 0.0});
    leaders_.push_back(place.row);
  }
  // Back in the order of the places, which lie close together in memory.
  std::sort(groups_.begin(), groups_.end(),
            [](const Group& a, const Group& b) { return a.first < b.first; });
  order_.clear();
  starts_.clear();
  for (const Group& group : groups_) {
    for (int k = group.first; k >= 0; k = next_[static_cast<std::size_t>(k)]) {
      order_.push_back(k);
      starts_.push_back(k == group.first);
    }
  }
}

}  // namespace gmrf_slap
