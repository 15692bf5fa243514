#include "particle_map.hpp"

#include <algorithm>
#include <cmath>

#include "field_core/errors.hpp"
#include "path_panels.hpp"

namespace gp_localize {

ParticleMap::ParticleMap(const GpLocalizeParams& params, const std::vector<FieldModel>& fields)
    : fields_(fields),
      slice_size_(params.observation_model == ObservationModelType::fitc ? 1 : params.slice_size),
      recent_(params.observation_model == ObservationModelType::online_pitc_assimilated
                  ? Recent::ignored
                  : Recent::used) {
  Maps blank;
  for (const FieldModel& field : fields_) {
    blank.emplace_back(static_cast<int>(field.basis.size()), slice_size_, recent_);
  }
  pool_.assign(params.particles, blank);
  evaluations_.resize(fields_.size() * params.particles);
  features_.resize(fields_.size());
  share_among_all(params.particles);
}

void ParticleMap::share_among_all(int particles) {
  owner_.assign(particles, 0);
  users_.assign(particles, 0);
  users_[0] = particles;
  free_.clear();
  free_.reserve(particles);
  for (int i = particles - 1; i > 0; --i) free_.push_back(i);
}

ParticleMap::Maps& ParticleMap::own_maps(std::size_t particle) {
  int& owner = owner_[particle];
  if (users_[owner] > 1) {
    const int copy = free_.back();  // exists: fewer maps are in use than there are particles
    free_.pop_back();
    pool_[copy] = pool_[owner];
    --users_[owner];
    users_[copy] = 1;
    owner = copy;
  }
  return pool_[owner];
}

void ParticleMap::restart(const field_core::SE2&, const Eigen::Matrix3d&, const MotionModel&,
                          field_core::Random&) {
  for (std::size_t f = 0; f < fields_.size(); ++f) {
    pool_[0][f] = OnlineSparseGp(static_cast<int>(fields_[f].basis.size()), slice_size_, recent_);
  }
  share_among_all(static_cast<int>(owner_.size()));
  steps_in_slice_ = 0;
}

void ParticleMap::relocate(const ParticleSet&, field_core::Random&) { end_slice(); }

void ParticleMap::weigh(const ParticleSet& particles, const field_core::SE2& sensor_in_base,
                        const std::vector<Observation>& observations,
                        std::vector<double>& log_likelihood, Innovation& innovation) {
  const std::size_t count = particles.size();
  points_.resize(2, count);
  for (std::size_t p = 0; p < count; ++p) {
    points_.col(p) = particles[p].pose * sensor_in_base.translation();
  }
  log_likelihood.assign(count, 0.0);
  innovation.mean.assign(observations.size(), 0.0);
  innovation.variance.assign(observations.size(), 0.0);
  for (std::size_t k = 0; k < observations.size(); ++k) {
    const Observation& o = observations[k];
    const SupportBasis& basis = fields_[o.field].basis;
    basis.features(points_, features_[k]);
    double mean = 0.0, square = 0.0;
    for (std::size_t p = 0; p < count; ++p) {
      OnlineSparseGp::Evaluation& at = evaluations_[k * count + p];
      pool_[owner_[p]][o.field].evaluate(basis, points_.col(p), features_[k].data() + p, count, at);
      const double variance = at.variance + o.likelihood_variance;
      const double error = o.value - at.mean;
      log_likelihood[p] -= 0.5 * (error * error / variance + std::log(variance));
      mean += particles[p].weight * at.mean;
      square += particles[p].weight * (variance + at.mean * at.mean);
    }
    innovation.mean[k] = mean;
    innovation.variance[k] = square - mean * mean;
  }
}

void ParticleMap::learn(const ParticleSet& particles, const field_core::SE2&,
                        const std::vector<Observation>& observations, field_core::Random&) {
  const std::size_t count = particles.size();
  for (std::size_t p = 0; p < count; ++p) {
    Maps& maps = own_maps(p);
    for (std::size_t k = 0; k < observations.size(); ++k) {
      const Observation& o = observations[k];
      maps[o.field].append(points_.col(p), features_[k].data() + p, count,
                           evaluations_[k * count + p], o.value, o.noise_variance);
    }
  }
  if (++steps_in_slice_ == slice_size_) end_slice();
}

void ParticleMap::end_slice() {
  steps_in_slice_ = 0;
  for (std::size_t i = 0; i < pool_.size(); ++i) {
    if (users_[i] == 0) continue;
    for (OnlineSparseGp& map : pool_[i]) map.end_slice();
  }
}

void ParticleMap::resampled(const std::vector<int>& ancestors) {
  new_owner_.resize(ancestors.size());
  std::fill(users_.begin(), users_.end(), 0);
  for (std::size_t p = 0; p < ancestors.size(); ++p) {
    new_owner_[p] = owner_[ancestors[p]];
    ++users_[new_owner_[p]];
  }
  owner_.swap(new_owner_);
  free_.clear();
  for (int i = static_cast<int>(users_.size()) - 1; i >= 0; --i) {
    if (users_[i] == 0) free_.push_back(i);
  }
}

void ParticleMap::predict(int field, const Eigen::Matrix2Xd& points, const ParticleSet& particles,
                          Eigen::VectorXd& mean, Eigen::VectorXd& variance) const {
  std::vector<double> weight_of_map(pool_.size(), 0.0), weights;
  std::vector<const OnlineSparseGp*> maps;
  for (std::size_t p = 0; p < particles.size(); ++p)
    weight_of_map[owner_[p]] += particles[p].weight;
  for (std::size_t i = 0; i < pool_.size(); ++i) {
    if (weight_of_map[i] <= 0.0) continue;
    maps.push_back(&pool_[i][field]);
    weights.push_back(weight_of_map[i]);
  }
  const SupportBasis& basis = fields_[field].basis;
  const auto panels = make_path_panels(basis, static_cast<int>(maps.size()), slice_size_, recent_,
                                       Precision::double_precision);
  Eigen::MatrixXd summaries(OnlineSparseGp::summary_size(static_cast<int>(basis.size())),
                            static_cast<Eigen::Index>(maps.size()));
  for (std::size_t i = 0; i < maps.size(); ++i) maps[i]->closed_summary(summaries.col(i).data());
  panels->assimilate(summaries);
  panels->weight(weights);
  extend_by_open_rows(basis, maps, *panels);
  Eigen::Matrix2Xd moments;
  panels->add(basis, points, 0.0, 0.0, nullptr, moments);
  mean = moments.row(0).transpose();
  variance = (moments.row(1) - moments.row(0).cwiseAbs2()).transpose().cwiseMax(0.0);
}

void ParticleMap::save(field_core::State& state) const {
  state.set("steps_in_slice", steps_in_slice_);
  Eigen::MatrixXd owner(1, owner_.size());
  for (std::size_t p = 0; p < owner_.size(); ++p) owner(0, p) = owner_[p];
  state.set("map_of_particle", owner);
  for (std::size_t f = 0; f < fields_.size(); ++f) {
    const auto rows = OnlineSparseGp::number_count(pool_[0][f].support_size(), slice_size_);
    Eigen::MatrixXd numbers = Eigen::MatrixXd::Zero(rows, pool_.size());
    for (std::size_t i = 0; i < pool_.size(); ++i) {
      if (users_[i] == 0) continue;
      const std::vector<double> all = pool_[i][f].numbers();
      numbers.col(i) = Eigen::Map<const Eigen::VectorXd>(all.data(), rows);
    }
    state.set("map/" + fields_[f].info.name, numbers);
  }
}

void ParticleMap::restore(const field_core::State& state) {
  const auto count = static_cast<Eigen::Index>(owner_.size());
  const Eigen::MatrixXd owner = state.matrix("map_of_particle", 1, count);
  const int steps = static_cast<int>(state.scalar("steps_in_slice"));
  if (owner.minCoeff() < 0 || owner.maxCoeff() >= static_cast<double>(count)) {
    throw field_core::DataError(
        "the state's block 'map_of_particle' names maps that do not exist; "
        "the state file is damaged");
  }
  std::vector<const Eigen::MatrixXd*> numbers;
  for (const FieldModel& field : fields_) {
    const auto rows =
        OnlineSparseGp::number_count(static_cast<int>(field.basis.size()), slice_size_);
    numbers.push_back(&state.matrix("map/" + field.info.name, rows, count));
  }
  for (Eigen::Index i = 0; i < count; ++i) {
    for (std::size_t f = 0; f < fields_.size(); ++f) pool_[i][f].restore(numbers[f]->col(i).data());
    owner_[i] = static_cast<int>(owner(0, i));
  }
  std::vector<int> identity(owner_.size());
  for (std::size_t p = 0; p < identity.size(); ++p) identity[p] = static_cast<int>(p);
  resampled(identity);  // counts the users of each map anew
  steps_in_slice_ = steps;
}

}  // namespace gp_localize
