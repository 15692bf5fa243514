#include "particle_map.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "field_core/errors.hpp"
#include "path_panels.hpp"
#include "survey_map.hpp"

namespace gp_localize {

ParticleMap::ParticleMap(const GpLocalizeParams& params, const std::vector<FieldModel>& fields)
    : fields_(fields),
      slice_size_(params.observation_model == ObservationModelType::fitc ? 1 : params.slice_size),
      recent_(params.observation_model == ObservationModelType::online_pitc_assimilated
                  ? Recent::ignored
                  : Recent::used),
      outlier_share_(params.outlier_share) {
  const auto count = static_cast<std::size_t>(params.particles);
  Slices empty;
  for (const FieldModel& field : fields_) {
    const int m = static_cast<int>(field.basis.size());
    initial_.emplace_back(m);
    empty.emplace_back(m, slice_size_);
    phi_.emplace_back(m, params.particles);
    features_.resize(std::max<std::size_t>(features_.size(), m * count));
    Evaluation at;  // of its full size: the number of particles varies during the run
    at.covariances.resize((slice_size_ + 3) / 4 * 4);
    at.gain.resize(m);
    evaluations_.insert(evaluations_.end(), count, at);
  }
  points_.resize(2, params.particles);
  if (!params.survey.empty()) initial_ = map_from_survey(params.survey, fields_);
  closed_.assign(count, initial_);
  slices_.assign(count, empty);
  users_.reserve(count);
  kept_.reserve(count);
  for (auto* list : {&map_, &slice_, &new_map_, &new_slice_, &spare_slices_, &free_}) {
    list->reserve(count);
  }
  share_among_all(count);
}

void ParticleMap::share_among_all(std::size_t particles) {
  map_.assign(particles, 0);
  slice_.resize(particles);
  std::iota(slice_.begin(), slice_.end(), 0);
  recount_users();
}

void ParticleMap::recount_users() {
  users_.assign(closed_.size(), 0);
  for (const int map : map_) ++users_[map];
  free_.clear();
  for (int i = static_cast<int>(users_.size()) - 1; i >= 0; --i) {
    if (users_[i] == 0) free_.push_back(i);
  }
}

int ParticleMap::own_map(std::size_t particle) {
  int& map = map_[particle];
  if (users_[map] > 1) {
    --users_[map];
    map = free_.back();  // exists: fewer maps are in use than there are particles
    free_.pop_back();
    users_[map] = 1;
  }
  return map;
}

void ParticleMap::restart(const field_core::SE2&, const Eigen::Matrix3d&, const MotionModel&,
                          field_core::Random&) {
  closed_[0] = initial_;
  for (Slices& slices : slices_) {
    for (OpenSlice& slice : slices) slice.clear();
  }
  share_among_all(closed_.size());
  steps_in_slice_ = 0;
}

void ParticleMap::relocate(const ParticleSet&, field_core::Random&) { close_slices(); }

/// Of an error, up to a constant; with outliers that scatter as much as the field itself does.
double ParticleMap::log_density(double error, double variance, double signal_variance) const {
  const auto normal = [error](double v) { return -0.5 * (error * error / v + std::log(v)); };
  const double inlier = normal(variance);
  if (outlier_share_ == 0.0) return inlier;
  const double good = std::log1p(-outlier_share_) + inlier;
  const double bad = std::log(outlier_share_) + normal(variance + signal_variance);
  return std::max(good, bad) + std::log1p(std::exp(-std::abs(good - bad)));
}

void ParticleMap::weigh(const ParticleSet& particles, const field_core::SE2& sensor_in_base,
                        const std::vector<Observation>& observations,
                        std::vector<double>& log_likelihood, Innovation& innovation) {
  const std::size_t count = particles.size();
  for (std::size_t p = 0; p < count; ++p) {
    points_.col(p) = particles[p].pose * sensor_in_base.translation();
  }
  log_likelihood.assign(count, 0.0);
  innovation.mean.assign(observations.size(), 0.0);
  innovation.variance.assign(observations.size(), 0.0);
  for (std::size_t k = 0; k < observations.size(); ++k) {
    const Observation& o = observations[k];
    const SupportBasis& basis = fields_[o.field].basis;
    const auto n = static_cast<Eigen::Index>(count);
    basis.features(points_.leftCols(n), features_.data());
    phi_[o.field].leftCols(n) = Eigen::Map<const Features>(features_.data(), basis.size(), n);
    double mean = 0.0, square = 0.0;
    for (std::size_t p = 0; p < count; ++p) {
      Evaluation& at = evaluation(o.field, p);
      slices_[slice_[p]][o.field].evaluate(basis, closed_[map_[p]][o.field], points_.col(p),
                                           phi_[o.field].col(p).data(), recent_, at);
      const double variance = at.variance + o.likelihood_variance;
      const double error = o.value - at.mean;
      log_likelihood[p] += log_density(error, variance, basis.kernel().signal_variance());
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
    Slices& slices = slices_[slice_[p]];
    for (const Observation& o : observations) {
      slices[o.field].append(points_.col(p), phi_[o.field].col(p).data(), evaluation(o.field, p),
                             o.value, o.noise_variance);
    }
  }
  if (++steps_in_slice_ == slice_size_) close_slices();
}

void ParticleMap::close_slices() {
  steps_in_slice_ = 0;
  for (std::size_t p = 0; p < map_.size(); ++p) {
    const Slices& slices = slices_[slice_[p]];
    const auto is_open = [](const OpenSlice& slice) { return slice.open() > 0; };
    if (std::none_of(slices.begin(), slices.end(), is_open)) continue;
    const int before = map_[p], after = own_map(p);
    for (std::size_t f = 0; f < fields_.size(); ++f) {
      slices_[slice_[p]][f].close(closed_[before][f], closed_[after][f]);
    }
  }
}

void ParticleMap::resampled(const std::vector<int>& ancestors) {
  const std::size_t count = ancestors.size();
  new_map_.resize(count);
  new_slice_.assign(count, -1);
  kept_.assign(slices_.size(), 0);
  // The first child of a particle goes on with its slice; the others copy it into slices that no
  // particle uses any more.
  for (std::size_t p = 0; p < count; ++p) {
    const int ancestor = ancestors[p];
    new_map_[p] = map_[ancestor];
    if (p > 0 && ancestors[p - 1] == ancestor) continue;
    new_slice_[p] = slice_[ancestor];
    kept_[slice_[ancestor]] = 1;
  }
  spare_slices_.clear();
  for (std::size_t i = 0; i < kept_.size(); ++i) {
    if (!kept_[i]) spare_slices_.push_back(static_cast<int>(i));
  }
  for (std::size_t p = 0; p < count; ++p) {
    if (new_slice_[p] >= 0) continue;
    new_slice_[p] = spare_slices_.back();
    spare_slices_.pop_back();
    for (std::size_t f = 0; f < fields_.size(); ++f) {
      slices_[new_slice_[p]][f].copy_from(slices_[slice_[ancestors[p]]][f]);
    }
  }
  map_.swap(new_map_);
  slice_.swap(new_slice_);
  recount_users();
}

void ParticleMap::predict(int field, const Eigen::Matrix2Xd& points, const ParticleSet& particles,
                          Eigen::VectorXd& mean, Eigen::VectorXd& variance) const {
  const auto count = static_cast<Eigen::Index>(particles.size());
  const SupportBasis& basis = fields_[field].basis;
  const auto panels = make_path_panels(basis, static_cast<int>(count), slice_size_, recent_,
                                       Precision::double_precision);
  const auto slice = [&](Eigen::Index p) -> const OpenSlice& { return slices_[slice_[p]][field]; };
  Eigen::MatrixXd summaries(SupportPosterior::size(static_cast<int>(basis.size())), count);
  std::vector<double> weights(count);
  for (Eigen::Index p = 0; p < count; ++p) {
    const double* numbers = closed_[map_[p]][field].numbers();
    summaries.col(p) = Eigen::Map<const Eigen::VectorXd>(numbers, summaries.rows());
    weights[p] = particles[p].weight;
  }
  panels->assimilate(summaries);
  panels->weight(weights);
  Eigen::Matrix2Xd places(2, count);
  Features features(basis.size(), count);
  for (int i = 0; i < slice(0).open(); ++i) {  // all have measured the same
    for (Eigen::Index p = 0; p < count; ++p) {
      places.col(p) = slice(p).point(i);
      features.col(p) = Eigen::Map<const Eigen::VectorXd>(slice(p).features(i), basis.size());
    }
    panels->extend(basis, places, features, slice(0).value(i), slice(0).noise(i));
  }
  Eigen::Matrix2Xd moments;
  panels->add(basis, points, 0.0, 0.0, nullptr, moments);
  mean = moments.row(0).transpose();
  variance = (moments.row(1) - moments.row(0).cwiseAbs2()).transpose().cwiseMax(0.0);
}

void ParticleMap::save(field_core::State& state) const {
  const auto particles = static_cast<Eigen::Index>(map_.size());
  const auto maps = static_cast<Eigen::Index>(closed_.size());
  state.set("steps_in_slice", steps_in_slice_);
  Eigen::MatrixXd map(1, particles);
  for (Eigen::Index p = 0; p < particles; ++p) map(0, p) = map_[p];
  state.set("map_of_particle", map);
  for (std::size_t f = 0; f < fields_.size(); ++f) {
    const std::string& name = fields_[f].info.name;
    const int m = static_cast<int>(fields_[f].basis.size());
    Eigen::MatrixXd closed = Eigen::MatrixXd::Zero(SupportPosterior::size(m), maps);
    for (Eigen::Index i = 0; i < maps; ++i) {
      if (users_[i] == 0) continue;
      closed.col(i) = Eigen::Map<const Eigen::VectorXd>(closed_[i][f].numbers(), closed.rows());
    }
    Eigen::MatrixXd open(OpenSlice::number_count(m, slice_size_) + 1, particles);
    for (Eigen::Index p = 0; p < particles; ++p) {
      const OpenSlice& slice = slices_[slice_[p]][f];
      open(0, p) = slice.open();
      open.col(p).tail(open.rows() - 1) =
          Eigen::Map<const Eigen::VectorXd>(slice.numbers().data(), open.rows() - 1);
    }
    state.set("map/" + name, closed);
    state.set("slice/" + name, open);
  }
}

void ParticleMap::restore(const field_core::State& state, const std::vector<int>& ancestors) {
  const Eigen::MatrixXd map = state.matrix("map_of_particle", 1, -1);
  const int steps = static_cast<int>(state.scalar("steps_in_slice"));
  std::vector<const Eigen::MatrixXd*> closed, open;
  for (const FieldModel& field : fields_) {
    const int m = static_cast<int>(field.basis.size());
    closed.push_back(&state.matrix("map/" + field.info.name, SupportPosterior::size(m), -1));
    open.push_back(&state.matrix("slice/" + field.info.name,
                                 OpenSlice::number_count(m, slice_size_) + 1, map.cols()));
    if (map.minCoeff() < 0 || map.maxCoeff() >= static_cast<double>(closed.back()->cols())) {
      throw field_core::DataError(
          "the state's block 'map_of_particle' names maps that do not exist; "
          "the state file is damaged");
    }
  }
  // Maps that particles share are taken over once: `place` is where each is now.
  std::vector<int> place(closed.front()->cols(), -1);
  int maps = 0;
  map_.resize(ancestors.size());
  slice_.resize(ancestors.size());
  for (std::size_t p = 0; p < ancestors.size(); ++p) {
    const int from = static_cast<int>(map(0, ancestors[p]));
    const bool is_new = place[from] < 0;
    if (is_new) place[from] = maps++;
    map_[p] = place[from];
    slice_[p] = static_cast<int>(p);
    for (std::size_t f = 0; f < fields_.size(); ++f) {
      if (is_new) {
        const auto numbers = closed[f]->col(from);
        std::copy(numbers.data(), numbers.data() + numbers.size(), closed_[map_[p]][f].numbers());
      }
      const double* slice = open[f]->col(ancestors[p]).data();
      slices_[p][f].restore(static_cast<int>(slice[0]), slice + 1);
    }
  }
  recount_users();
  steps_in_slice_ = steps;
}

}  // namespace gp_localize
