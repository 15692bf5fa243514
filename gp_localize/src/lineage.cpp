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
  updates_ = 0;
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

void Lineage::step() {
  if (++updates_ < params_.horizon) return;
  updates_ = 0;
  old_.swap(recent_);
  std::iota(recent_.begin(), recent_.end(), 0);
}

double Lineage::paths_left(const ParticleSet& particles) const {
  std::fill(weights_.begin(), weights_.end(), 0.0);
  for (std::size_t i = 0; i < old_.size(); ++i) weights_[old_[i]] += particles[i].weight;
  return 1.0 / std::inner_product(weights_.begin(), weights_.end(), weights_.begin(), 0.0);
}

double Lineage::tempering(const ParticleSet& particles) const {
  if (params_.paths == 0) return 1.0;
  const double wanted =
      std::min<double>(params_.paths, 0.25 * static_cast<double>(particles.size()));
  return std::min(1.0, paths_left(particles) / wanted);
}

void Lineage::save(field_core::State& state) const {
  Eigen::MatrixXd numbers(2, old_.size());
  numbers << ranks(recent_), ranks(old_);
  state.set("lineage", numbers);
  state.set("lineage_updates", updates_);
}

void Lineage::restore(const field_core::State& state, std::size_t particles) {
  const Eigen::MatrixXd numbers = state.matrix("lineage", 2, static_cast<Eigen::Index>(particles));
  const double updates = state.scalar("lineage_updates");
  // Not the other way round: a NaN must not pass.
  const bool sound = (numbers.array() >= 0.0).all() &&
                     (numbers.array() < static_cast<double>(particles)).all() && updates >= 0.0;
  if (!sound) {
    throw field_core::DataError("the state's block 'lineage' is damaged; make the map again");
  }
  recent_.resize(particles);
  old_.resize(particles);
  for (std::size_t i = 0; i < particles; ++i) {
    recent_[i] = static_cast<int>(numbers(0, i));
    old_[i] = static_cast<int>(numbers(1, i));
  }
  updates_ = static_cast<int>(std::min<double>(updates, params_.horizon));
}

}  // namespace gp_localize
