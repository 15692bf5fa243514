// Which hyperparameters each particle tries, and what the particles predict together.
#include <algorithm>
#include <cmath>

#include "particle_map.hpp"
#include "path_panels.hpp"

namespace gp_localize {

/// Every candidate of a group as often as any other, in random order: groups are independent,
/// unless all fields of a particle share one.
void ParticleMap::draw_candidates(field_core::Random& random) {
  const std::size_t groups = first_.size(), count = closed_.size();
  candidate_.assign(count * groups, 0);
  for (std::size_t g = 0; g < groups; ++g) {
    const std::size_t choices = candidates_[first_[g]].size();
    if (choices == 1) continue;
    const auto at = [&](std::size_t p) -> int& { return candidate_[p * groups + g]; };
    if (shared_candidate_ && g > 0) {
      for (std::size_t p = 0; p < count; ++p) at(p) = candidate_[p * groups];
      continue;
    }
    for (std::size_t p = 0; p < count; ++p) at(p) = static_cast<int>(p % choices);
    for (std::size_t p = count - 1; p > 0; --p) std::swap(at(p), at(random.index(p + 1)));
  }
}

void ParticleMap::find_members(int field, int c, std::size_t count) const {
  members_.clear();
  for (std::size_t p = 0; p < count; ++p) {
    if (candidate_[p * first_.size() + fields_[field].group] == c) members_.push_back(p);
  }
}

void ParticleMap::compute_features(int field, std::size_t count) {
  for (std::size_t c = 0; c < candidates_[field].size(); ++c) {
    find_members(field, static_cast<int>(c), count);
    const auto n = static_cast<Eigen::Index>(members_.size());
    if (n == 0) continue;
    for (Eigen::Index i = 0; i < n; ++i) {
      gathered_.col(i) << points_.col(members_[i]), static_cast<double>(fields_[field].member);
    }
    const SupportBasis& basis = candidates_[field][c].basis;
    basis.features(gathered_.topLeftCorner(basis.place_dimensions(), n), features_.data());
    const Eigen::Map<const Features> features(features_.data(), basis.size(), n);
    for (Eigen::Index i = 0; i < n; ++i) phi_[field].col(members_[i]) = features.col(i);
  }
}

/// Where the robot stands, if the support there says too little of a field.
void ParticleMap::grow_support(const ParticleSet& particles) {
  if (!fields_.front().basis.has_room()) return;
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  for (std::size_t p = 0; p < particles.size(); ++p) {
    place += particles[p].weight * points_.col(p);
  }
  double most = 0.0, least = 1.0;
  for (std::size_t f = 0; f < fields_.size(); ++f) {
    most = std::max(most, fields_[f].basis.unexplained(place));
    for (const FieldModel& m : candidates_[f]) least = std::min(least, m.basis.unexplained(place));
  }
  constexpr double kSingular = 1e-3;  // to a candidate with long scales the place is not new
  if (most <= grow_at_ || least <= kSingular) return;
  grow_all(place);
  for (std::size_t p = 0; p < map_.size(); ++p) {
    for (std::size_t g = 0; g < first_.size(); ++g) {
      slices_[slice_[p]][g].extend(model(p, first_[g]).basis);
    }
  }
}

void ParticleMap::grow_all(const Eigen::Vector2d& place) {
  for (std::size_t f = 0; f < fields_.size(); ++f) {
    fields_[f].basis.grow(place);
    for (FieldModel& m : candidates_[f]) m.basis.grow(place);
  }
}

void ParticleMap::forget_grown_support() {
  for (std::size_t f = 0; f < fields_.size(); ++f) {
    fields_[f].basis.forget_grown();
    for (FieldModel& m : candidates_[f]) m.basis.forget_grown();
  }
}

Eigen::Matrix2Xd ParticleMap::grown_support() const {
  const Eigen::Matrix2Xd all = fields_.front().basis.support();
  return all.rightCols(all.cols() - first_support_);
}

FieldVariances ParticleMap::variances(int field, const ParticleSet& particles) const {
  const FieldModel& configured = fields_[field];
  if (candidates_[field].size() == 1 && !factors_.active()) {
    return {configured.signal_variance(), configured.noise_variance};
  }
  FieldVariances sum{0.0, 0.0};
  for (std::size_t p = 0; p < particles.size(); ++p) {
    const double weight = particles[p].weight * factor(p, field);
    sum.signal += weight * model(p, field).signal_variance();
    sum.noise += weight * model(p, field).noise_variance;
  }
  return sum;
}

std::vector<field_core::HyperparameterPosterior> ParticleMap::hyperparameters(
    const ParticleSet& particles) const {
  std::vector<field_core::HyperparameterPosterior> all;
  const bool learned = candidates_.front().size() > 1 || factors_.active();
  const bool surveyed = initial_.size() > 1;
  for (std::size_t f = 0; f < fields_.size() && learned; ++f) {
    const auto count = static_cast<Eigen::Index>(candidates_[f].size());
    field_core::HyperparameterPosterior posterior{
        fields_[f].info.name,
        {"length_scale_x", "length_scale_y", "noise_stddev", "signal_stddev"},
        Eigen::MatrixXd(surveyed ? 5 : 4, count),
        Eigen::VectorXd::Zero(count)};
    if (surveyed) posterior.names.push_back("survey_correlation");
    Eigen::VectorXd factors = posterior.probability;  // of each candidate's particles, weighted
    for (std::size_t p = 0; p < particles.size(); ++p) {
      const int c = candidate_[p * first_.size() + fields_[f].group];
      posterior.probability[c] += particles[p].weight;
      factors[c] += particles[p].weight * factor(p, static_cast<int>(f));
    }
    for (Eigen::Index c = 0; c < count; ++c) {
      const FieldModel& m = candidates_[f][c];
      const auto& kernel = m.basis.kernel();
      const double weight = posterior.probability[c];
      const double scale = factors_.active() && weight > 0.0 ? factors[c] / weight : 1.0;
      posterior.values.col(c).head<4>() << kernel.length_scales(),
          std::sqrt(scale * m.noise_variance), std::sqrt(scale * m.signal_variance());
      if (surveyed) posterior.values(4, c) = m.survey_correlation;
    }
    all.push_back(std::move(posterior));
  }
  return all;
}

/// Mean and mean square at `points` of the mixture of members_ under their candidate c; about_zero:
/// as if all had measured the prior mean, so that the squares are the variances alone.
Eigen::Matrix2Xd ParticleMap::predict_members(int field, int c, const Eigen::Matrix2Xd& points,
                                              const std::vector<double>& weights,
                                              Moments which) const {
  const double values = which == Moments::all ? 1.0 : 0.0;
  const auto count = static_cast<Eigen::Index>(members_.size());
  const FieldModel& model = candidates_[field][c];
  const SupportBasis& basis = model.basis;
  const auto panels = make_path_panels(basis, static_cast<int>(count), slice_size_, recent_,
                                       Precision::double_precision);
  const auto slice = [&](Eigen::Index i) -> const OpenSlice& {
    return slices_[slice_[members_[i]]][model.group];
  };
  Eigen::MatrixXd summaries(SupportPosterior::size(static_cast<int>(basis.size())), count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const double* numbers = closed_[map_[members_[i]]][model.group].numbers();
    summaries.col(i) = Eigen::Map<const Eigen::VectorXd>(numbers, summaries.rows());
  }
  summaries.bottomRows(basis.size()) *= values;
  panels->assimilate(summaries);
  panels->weight(weights);
  Places places(basis.place_dimensions(), count);
  Features features(basis.size(), count);
  for (int k = 0; k < slice(0).open(); ++k) {  // all have measured the same
    for (Eigen::Index i = 0; i < count; ++i) {
      places.col(i) = slice(i).point(k);
      features.col(i) = Eigen::Map<const Eigen::VectorXd>(slice(i).features(k), basis.size());
    }
    panels->extend(basis, places, features, values * slice(0).value(k), slice(0).noise(k));
  }
  Eigen::Matrix2Xd moments;
  panels->add(basis, model.places(points), 0.0, 0.0, nullptr, moments);
  return moments;
}

void ParticleMap::predict(int field, const Eigen::Matrix2Xd& points, const ParticleSet& particles,
                          Eigen::VectorXd& mean, Eigen::VectorXd& variance) const {
  Eigen::Matrix2Xd moments = Eigen::Matrix2Xd::Zero(2, points.cols());
  std::vector<double> weights;
  for (std::size_t c = 0; c < candidates_[field].size(); ++c) {
    find_members(field, static_cast<int>(c), particles.size());
    double total = 0.0;
    for (const std::size_t p : members_) total += particles[p].weight;
    if (!(total > 0.0)) continue;
    weights.clear();
    for (const std::size_t p : members_) weights.push_back(particles[p].weight / total);
    moments += total * predict_members(field, static_cast<int>(c), points, weights, Moments::all);
    if (!factors_.active()) continue;
    for (std::size_t i = 0; i < weights.size(); ++i) weights[i] *= factor(members_[i], field) - 1.0;
    moments.row(1) +=
        total *
        predict_members(field, static_cast<int>(c), points, weights, Moments::about_zero).row(1);
  }
  mean = moments.row(0).transpose();
  variance = (moments.row(1) - moments.row(0).cwiseAbs2()).transpose().cwiseMax(0.0);
}

}  // namespace gp_localize
