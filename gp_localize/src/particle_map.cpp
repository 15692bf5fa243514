#include "particle_map.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "packed_symmetric.hpp"
#include "survey_map.hpp"

namespace gp_localize {

ParticleMap::ParticleMap(const GpLocalizeParams& params, const std::vector<FieldModel>& fields)
    : fields_(fields),
      first_(first_fields(fields)),
      candidates_(make_candidates(params, fields)),
      shared_candidate_(params.candidates.shared),
      grow_at_(params.support.grow_at),
      first_support_(fields.front().basis.support().cols()),
      candidate_(params.particles * first_.size(), 0),
      slice_size_(params.observation_model == ObservationModelType::fitc ? 1 : params.slice_size),
      recent_(params.observation_model == ObservationModelType::online_pitc_assimilated
                  ? Recent::ignored
                  : Recent::used),
      outlier_share_(params.outlier_share),
      offsets_(params, fields),
      factors_(params, first_.size()),
      map_error_(params, fields),
      surveyed_(!params.survey.empty()) {
  const auto count = static_cast<std::size_t>(params.particles);
  Slices empty;
  Closed prior;
  for (const FieldModel& field : fields_) {
    const int m = static_cast<int>(field.basis.size());
    const int steps = slice_size_ * field.basis.fields();
    if (field.group == static_cast<int>(prior.size())) {
      prior.emplace_back(m);
      empty.emplace_back(m, steps, field.basis.place_dimensions());
    }
    phi_.emplace_back(m, params.particles);
    features_.resize(std::max<std::size_t>(features_.size(), m * count));
    gain_.resize(std::max<std::size_t>(gain_.size(), m));
    Evaluation at;  // of its full size: the number of particles varies during the run
    at.covariances.resize((steps + 3) / 4 * 4);
    at.gain.resize(m);
    evaluations_.insert(evaluations_.end(), count, at);
  }
  density_.resize(count);
  points_.resize(2, params.particles);
  gathered_.resize(3, params.particles);
  if (first_.size() < fields_.size()) {
    joint_.resize(count * fields_.size() * (fields_.size() + 1));
  }
  weighed_.assign(first_.size(), {});
  for (auto& list : weighed_) list.reserve(fields_.size());
  members_.reserve(count);
  new_candidate_.reserve(candidate_.size());
  if (!surveyed_) initial_ = {prior};
  for (std::size_t c = 0; surveyed_ && c < candidates_.front().size(); ++c) {
    std::vector<FieldModel> models;
    for (const auto& field : candidates_) models.push_back(field[c]);
    initial_.push_back(map_from_survey(params.survey, models));
  }
  closed_.assign(count, prior);
  slices_.assign(count, empty);
  users_.reserve(count);
  kept_.reserve(count);
  for (auto* list : {&map_, &slice_, &new_map_, &new_slice_, &spare_slices_, &free_}) {
    list->reserve(count);
  }
  start_from_initial();
}

void ParticleMap::start_from_initial() {
  closed_[0] = initial_[0];
  share_among_all(closed_.size());
  if (initial_.size() == 1) return;
  for (std::size_t p = 0; p < closed_.size(); ++p) {
    map_[p] = static_cast<int>(p);
    for (std::size_t g = 0; g < first_.size(); ++g) {
      closed_[p][g] = initial_[candidate_[p * first_.size() + g]][g];
    }
  }
  recount_users();
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
                          field_core::Random& random) {
  draw_candidates(random);
  offsets_.restart();
  factors_.restart();
  map_error_.restart();
  known_.clear();
  forget_grown_support();
  for (Slices& slices : slices_) {
    for (OpenSlice& slice : slices) slice.clear();
  }
  start_from_initial();
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
  for (auto& list : weighed_) list.clear();
  factors_.begin();
  for (std::size_t k = 0; k < observations.size(); ++k) {
    const Observation& o = observations[k];
    compute_features(o.field, count);
    offsets_.advance(o.field, o.stamp);
    factors_.reading(fields_[o.field].group);
    double mean = 0.0, square = 0.0, map_variance = 0.0;
    for (std::size_t p = 0; p < count; ++p) {
      const FieldModel& field = model(p, o.field);
      Evaluation& at = evaluation(o.field, p);
      slices_[slice_[p]][field.group].evaluate(field.basis, closed_[map_[p]][field.group],
                                               field.place(points_.col(p)),
                                               phi_[o.field].col(p).data(), recent_, at);
      double variance = at.variance + noise_ratio(p, o.field) * o.likelihood_variance;
      double expected = at.mean;
      if (offsets_.active()) {
        expected += offsets_.mean(p, o.field);
        variance += offsets_.variance(p, o.field);
      }
      if (field.basis.fields() > 1) condition_on_partners(p, o, expected, variance);
      const double error = o.value - expected;
      map_variance += particles[p].weight * at.variance;
      density_[p] = factors_.active() ? factors_.density(p, field.group, error, variance)
                                      : log_density(error, variance, field.signal_variance());
      mean += particles[p].weight * expected;
      square += particles[p].weight * (variance + expected * expected);
    }
    const double power = map_error_.power(o.field, map_variance, o.likelihood_variance);
    for (std::size_t p = 0; p < count; ++p) log_likelihood[p] += power * density_[p];
    innovation.mean[k] = mean;
    innovation.variance[k] = square - mean * mean;
    weighed_[fields_[o.field].group].push_back(o.field);
  }
}

/// Of a reading, given those before it in this step that are of the same group: fields at one place
/// are correlated by what the map does not know.
void ParticleMap::condition_on_partners(std::size_t p, const Observation& o, double& mean,
                                        double& variance) {
  const FieldModel& field = model(p, o.field);
  const OpenSlice& slice = slices_[slice_[p]][field.group];
  double* row = joint_row(p, o.field);
  std::size_t n = 0;
  for (const int other : weighed_[field.group]) {
    const double* before = joint_row(p, other);
    double rest = slice.covariance(field.basis.prior(field.member, fields_[other].member),
                                   phi_[o.field].col(p).data(), evaluation(o.field, p),
                                   phi_[other].col(p).data(), evaluation(other, p), recent_);
    for (std::size_t i = 0; i < n; ++i) rest -= row[i] * before[i];
    row[n] = rest * before[n];
    mean += row[n] * before[fields_.size()];
    variance -= row[n] * row[n];
    ++n;
  }
  row[n] = 1.0 / std::sqrt(variance);
  row[fields_.size()] = (o.value - mean) * row[n];
}

void ParticleMap::accept(const std::vector<Observation>& observations) {
  factors_.accept();
  for (const Observation& o : observations) map_error_.accept(o.field);
  if (!offsets_.active()) return;
  for (const Observation& o : observations) {
    for (std::size_t p = 0; p < map_.size(); ++p) {
      const Evaluation& at = evaluation(o.field, p);
      offsets_.learn(p, o.field, o.value - at.mean - offsets_.mean(p, o.field),
                     at.variance + offsets_.variance(p, o.field) + o.likelihood_variance);
    }
  }
}

void ParticleMap::learn(const ParticleSet& particles, const field_core::SE2&,
                        const std::vector<Observation>& observations, field_core::Random&) {
  const std::size_t count = particles.size();
  for (std::size_t p = 0; p < count; ++p) {
    Slices& slices = slices_[slice_[p]];
    for (const Observation& o : observations) {
      const FieldModel& field = model(p, o.field);
      const double* phi = phi_[o.field].col(p).data();
      const Place place = field.place(points_.col(p));
      Evaluation& at = evaluation(o.field, p);
      OpenSlice& slice = slices[field.group];
      slice.update(field.basis, place, phi, at);  // with its partners' readings of this step
      slice.append(place, phi, at, o.value, noise_ratio(p, o.field) * o.noise_variance);
    }
  }
  grow_support(particles);
  if (++steps_in_slice_ == slice_size_) close_slices();
}

double ParticleMap::unknown(const ParticleSet& particles,
                            const std::vector<Observation>& observations) const {
  if (known_.empty() && !surveyed_) return 1.0;
  const auto likelier = [](const Particle& a, const Particle& b) { return a.weight < b.weight; };
  const std::size_t p =
      std::max_element(particles.begin(), particles.end(), likelier) - particles.begin();
  double open = 0.0;
  for (const Observation& o : observations) {
    const FieldModel& field = model(p, o.field);
    const int group = field.group, m = static_cast<int>(field.basis.size());
    const Closed& known =
        known_.empty() ? initial_[candidate_[p * first_.size() + group]] : known_.front();
    const double* phi = phi_[o.field].col(p).data();
    packed_multiply(known[group].covariance(), m, phi, gain_.data());
    const double explained = dot_product(phi, phi, m) - dot_product(phi, gain_.data(), m);
    open += 1.0 - std::clamp(explained / field.signal_variance(), 0.0, 1.0);
  }
  return open / static_cast<double>(observations.size());
}

void ParticleMap::keep_as_known() {
  known_ = {closed_[std::max_element(users_.begin(), users_.end()) - users_.begin()]};
}

void ParticleMap::close_slices() {
  steps_in_slice_ = 0;
  for (std::size_t p = 0; p < map_.size(); ++p) {
    const Slices& slices = slices_[slice_[p]];
    const auto is_open = [](const OpenSlice& slice) { return slice.open() > 0; };
    if (std::none_of(slices.begin(), slices.end(), is_open)) continue;
    const int before = map_[p], after = own_map(p);
    for (std::size_t g = 0; g < first_.size(); ++g) {
      slices_[slice_[p]][g].close(closed_[before][g], closed_[after][g]);
    }
  }
}

void ParticleMap::resampled(const std::vector<int>& ancestors) {
  const std::size_t count = ancestors.size(), groups = first_.size();
  new_candidate_.resize(count * groups);
  for (std::size_t p = 0; p < count; ++p) {
    std::copy_n(candidate_.begin() + ancestors[p] * groups, groups,
                new_candidate_.begin() + p * groups);
  }
  candidate_.swap(new_candidate_);
  offsets_.resampled(ancestors);
  factors_.resampled(ancestors);
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
    for (std::size_t g = 0; g < groups; ++g) {
      slices_[new_slice_[p]][g].copy_from(slices_[slice_[ancestors[p]]][g]);
    }
  }
  map_.swap(new_map_);
  slice_.swap(new_slice_);
  recount_users();
}

}  // namespace gp_localize
