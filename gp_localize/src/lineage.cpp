#include "gp_localize/lineage.hpp"

#include <algorithm>
#include <numeric>

#include "field_core/errors.hpp"

namespace gp_localize {
namespace {

/// Numbers below the number of particles, in the same order: those of many particles may be kept by
/// a filter that now has few, and be restored to one that never has more.
Eigen::RowVectorXd ranks(const std::vector<int>& numbers) {
  std::vector<int> sorted = numbers;
  std::sort(sorted.begin(), sorted.end());
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  Eigen::RowVectorXd ranks(numbers.size());
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    ranks[i] = static_cast<double>(std::lower_bound(sorted.begin(), sorted.end(), numbers[i]) -
                                   sorted.begin());
  }
  return ranks;
}

}  // namespace

Lineage::Lineage(const DiversityParams& params, int most) : params_(params), weights_(most) {
  for (auto* numbers : {&recent_, &old_, &scratch_}) numbers->reserve(most);
}

void Lineage::restart(std::size_t particles) {
  period_ = before_ = {};
  recent_.resize(particles);
  std::iota(recent_.begin(), recent_.end(), 0);
  old_ = recent_;
}

void Lineage::resampled(const std::vector<int>& ancestors) {
  scratch_.resize(ancestors.size());
  for (auto* of : {&recent_, &old_}) {
    for (std::size_t i = 0; i < ancestors.size(); ++i) scratch_[i] = (*of)[ancestors[i]];
    of->assign(scratch_.begin(), scratch_.end());
  }
}

void Lineage::step(double unknown) {
  ++period_.updates;
  period_.unknown += unknown;
  if (period_.updates < params_.horizon) return;
  before_ = period_;
  period_ = {};
  old_.swap(recent_);
  std::iota(recent_.begin(), recent_.end(), 0);
}

double Lineage::paths_left(const ParticleSet& particles) const {
  std::fill(weights_.begin(), weights_.end(), 0.0);
  for (std::size_t i = 0; i < old_.size(); ++i) weights_[old_[i]] += particles[i].weight;
  return 1.0 / std::inner_product(weights_.begin(), weights_.end(), weights_.begin(), 0.0);
}

double Lineage::unknown() const {
  const double updates = before_.updates + period_.updates;
  return updates > 0.0 ? (before_.unknown + period_.unknown) / updates : 1.0;
}

double Lineage::tempering(const ParticleSet& particles) const {
  const double wanted =
      unknown() * std::min<double>(params_.paths, 0.25 * static_cast<double>(particles.size()));
  if (!(wanted > 0.0)) return 1.0;
  return std::min(1.0, paths_left(particles) / wanted);
}

void Lineage::save(field_core::State& state) const {
  Eigen::MatrixXd numbers(2, old_.size());
  numbers << ranks(recent_), ranks(old_);
  state.set("lineage", numbers);
  state.set("lineage_periods", Eigen::MatrixXd(Eigen::Vector4d(period_.updates, period_.unknown,
                                                               before_.updates, before_.unknown)));
}

void Lineage::restore(const field_core::State& state, std::size_t particles) {
  const Eigen::MatrixXd numbers = state.matrix("lineage", 2, static_cast<Eigen::Index>(particles));
  const Eigen::Vector4d periods = state.matrix("lineage_periods", 4, 1);
  // Not the other way round: a NaN must not pass.
  const bool sound =
      (numbers.array() >= 0.0).all() && (numbers.array() < static_cast<double>(particles)).all() &&
      (periods.array() >= 0.0).all() && periods[1] <= periods[0] && periods[3] <= periods[2];
  if (!sound) {
    throw field_core::DataError("the state's block 'lineage' is damaged; make the map again");
  }
  recent_.resize(particles);
  old_.resize(particles);
  for (std::size_t i = 0; i < particles; ++i) {
    recent_[i] = static_cast<int>(numbers(0, i));
    old_[i] = static_cast<int>(numbers(1, i));
  }
  period_ = {periods[0], periods[1]};
  before_ = {periods[2], periods[3]};
}

}  // namespace gp_localize
