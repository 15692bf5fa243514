#include "place_mixture.hpp"

#include <algorithm>
#include <cmath>

namespace gmrf_slap {
namespace {

/// Equal for rows that may be joined.
long key_of(const SiteRow& row) {
  if (row.count != 4) return -1 - row.site[0];
  const auto quarter = [](double share) { return static_cast<long>(4.0 * share); };
  const double u = row.weight[1] + row.weight[3], v = row.weight[2] + row.weight[3];
  return 16 * static_cast<long>(row.site[0]) + 4 * quarter(u) + quarter(v);
}

bool same_sites(const SiteRow& a, const SiteRow& b) {
  return a.count == b.count && a.site == b.site && (a.count == 4 || a.weight == b.weight);
}

}  // namespace

void PlaceMixture::add(const SiteRow& row, double weight, double residual) {
  if (row.count > 0 && weight > 0.0)
    places_.push_back({key_of(row), static_cast<int>(places_.size()), weight, residual, row});
}

void PlaceMixture::join() {
  // Places of one key are summed in the order they were added (std::stable_sort would allocate).
  std::sort(places_.begin(), places_.end(), [](const Place& a, const Place& b) {
    return a.key != b.key ? a.key < b.key : a.order < b.order;
  });
  std::size_t last = 0;
  for (std::size_t i = 1; i < places_.size(); ++i) {
    Place& to = places_[last];
    const Place& from = places_[i];
    if (from.key != to.key || !same_sites(from.row, to.row)) {
      places_[++last] = from;
      continue;
    }
    const double share = from.weight / (to.weight + from.weight);
    for (std::size_t a = 0; a < to.row.weight.size(); ++a) {
      to.row.weight[a] += share * (from.row.weight[a] - to.row.weight[a]);
    }
    to.residual += share * (from.residual - to.residual);
    to.weight += from.weight;
  }
  places_.resize(std::min(places_.size(), last + 1));
}

double PlaceMixture::prune(double mass) {
  sorted_.clear();
  for (const Place& place : places_) sorted_.push_back(place.weight);
  std::sort(sorted_.begin(), sorted_.end());
  std::size_t lightest = 0;
  double removed = 0.0;
  while (lightest + 1 < sorted_.size() && removed + sorted_[lightest] <= mass) {
    removed += sorted_[lightest++];
  }
  // Places as heavy as the lightest that stays, stay.
  const double least = sorted_[lightest];
  removed = 0.0;
  const auto light = [&](const Place& place) {
    if (place.weight < least) removed += place.weight;
    return place.weight < least;
  };
  places_.erase(std::remove_if(places_.begin(), places_.end(), light), places_.end());
  return removed;
}

double PlaceMixture::group(const GaussianField& field, double total, double noise,
                           double merge_loss) {
  pieces_.resize(places_.size());
  double information = 0.0, clearest = 1.0;
  for (std::size_t k = 0; k < places_.size(); ++k) {
    const double s = variance_[k] + noise, g = (places_[k].residual - mean_[k]) / s;
    pieces_[k] = {places_[k].row, places_[k].weight / total * (1.0 / s - g * g), variance_[k]};
    information += std::abs(pieces_[k].curvature) * variance_[k];
    clearest = std::min(clearest, noise / s);
  }
  // Sigma' >= min noise/s Sigma: groups that make it smaller may take half of that.
  groups_.build(field, pieces_, merge_loss, 0.5 * clearest);
  const double lost = groups_.positive_loss() + groups_.negative_loss();
  return lost > 0.0 ? lost / information : 0.0;
}

LeftOut PlaceMixture::condition(GaussianField& field, double noise, const Thrift& thrift) {
  join();
  LeftOut out;
  if (places_.empty()) return out;
  double total = 0.0;
  for (const Place& place : places_) total += place.weight;
  const double pruned = prune(thrift.prune_mass * total);
  const double kept = total - pruned;
  const std::size_t count = places_.size();
  rows_.resize(std::max(rows_.size(), count));
  mean_.resize(rows_.size());
  variance_.resize(rows_.size());
  for (std::size_t k = 0; k < count; ++k) rows_[k] = places_[k].row;
  field.predict(rows_.data(), static_cast<int>(count), mean_.data(), variance_.data());
  const bool grouped = thrift.merge_loss > 0.0 && count > 1;
  if (grouped) out.information = group(field, kept, noise, thrift.merge_loss);
  update_.clear(static_cast<int>(count));
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t k = grouped ? static_cast<std::size_t>(groups_.order()[i]) : i;
    update_.add(rows_[k], places_[k].weight / kept, places_[k].residual - mean_[k],
                variance_[k] + noise, grouped && !groups_.starts()[i]);
  }
  field.condition(update_);
  out.mass = pruned / total;
  return out;
}

}  // namespace gmrf_slap
