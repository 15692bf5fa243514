#include "sample_path_map.hpp"

#include "field_core/errors.hpp"
#include "gp_localize/resampling.hpp"

namespace gp_localize {

using field_core::SE2;

SamplePathMap::SamplePathMap(const GpLocalizeParams& params, const std::vector<FieldModel>& fields)
    : fields_(fields),
      slice_size_(params.slice_size),
      redraw_(params.redraw_sample_paths),
      recent_(params.observation_model == ObservationModelType::online_pitc ? Recent::used
                                                                            : Recent::ignored),
      paths_(params.sample_paths) {
  for (const FieldModel& field : fields_) {
    panels_.push_back(
        make_path_panels(field.basis, params.sample_paths, slice_size_, recent_, params.precision));
  }
}

void SamplePathMap::restart(const SE2& pose, const Eigen::Matrix3d& covariance,
                            const MotionModel& model, field_core::Random& random) {
  for (RobotState& path : paths_) path = model.draw(pose, covariance, random);
  maps_.clear();
  closed_.clear();
  for (const FieldModel& field : fields_) {
    const int m = static_cast<int>(field.basis.size());
    maps_.emplace_back(paths_.size(), OnlineSparseGp(m, slice_size_, recent_));
    closed_.emplace_back(OnlineSparseGp::summary_size(m), paths_.size());
  }
  close_slice();
}

void SamplePathMap::relocate(const ParticleSet& particles, field_core::Random& random) {
  redraw_paths(particles, random);
  close_slice();  // the next measurement is far from the last
}

void SamplePathMap::move(const field_core::OdometryMotion& motion, const MotionModel& model,
                         field_core::Random& random) {
  for (RobotState& path : paths_) model.move(motion, path, random);
}

void SamplePathMap::weigh(const ParticleSet& particles, const SE2& sensor_in_base,
                          const std::vector<Observation>& observations,
                          std::vector<double>& log_likelihood, Innovation& innovation) {
  points_.resize(2, particles.size());
  for (std::size_t i = 0; i < particles.size(); ++i) {
    points_.col(i) = particles[i].pose * sensor_in_base.translation();
  }
  PathPanels* total = panels_.front().get();
  total->begin(static_cast<int>(particles.size()));
  innovation.mean.assign(observations.size(), 0.0);
  innovation.variance.assign(observations.size(), 0.0);
  for (std::size_t k = 0; k < observations.size(); ++k) {
    const Observation& o = observations[k];
    const SupportBasis& basis = fields_[o.field].basis;
    basis.features(points_, features_);
    panels_[o.field]->add(basis, points_, features_, o.value, o.likelihood_variance, total,
                          moments_);
    double mean = 0.0, square = 0.0;
    for (std::size_t i = 0; i < particles.size(); ++i) {
      mean += particles[i].weight * moments_(0, i);
      square += particles[i].weight * moments_(1, i);
    }
    innovation.mean[k] = mean;
    innovation.variance[k] = square - mean * mean;
  }
  total->log_mean(log_likelihood);
}

void SamplePathMap::learn(const ParticleSet& particles, const SE2& sensor_in_base,
                          const std::vector<Observation>& observations,
                          field_core::Random& random) {
  path_points_.resize(2, paths_.size());
  for (std::size_t c = 0; c < paths_.size(); ++c) {
    path_points_.col(c) = paths_[c].pose * sensor_in_base.translation();
  }
  for (const Observation& o : observations) {
    const SupportBasis& basis = fields_[o.field].basis;
    basis.features(path_points_, path_features_);
    panels_[o.field]->extend(basis, path_points_, path_features_, o.value, o.noise_variance);
    for (std::size_t c = 0; c < paths_.size(); ++c) {
      OnlineSparseGp& map = maps_[o.field][c];
      const double* phi = path_features_.data() + c;
      map.evaluate(basis, path_points_.col(c), phi, path_features_.cols(), evaluation_);
      map.append(path_points_.col(c), phi, path_features_.cols(), evaluation_, o.value,
                 o.noise_variance);
    }
  }
  if (++steps_in_slice_ < slice_size_) return;
  close_slice();
  if (redraw_) redraw_paths(particles, random);
}

void SamplePathMap::close_slice() {
  steps_in_slice_ = 0;
  for (std::size_t f = 0; f < fields_.size(); ++f) {
    for (std::size_t c = 0; c < paths_.size(); ++c) {
      maps_[f][c].end_slice();
      closed_[f].col(c) =
          Eigen::Map<const Eigen::VectorXd>(maps_[f][c].summary(), closed_[f].rows());
    }
    panels_[f]->assimilate(closed_[f]);
  }
}

void SamplePathMap::redraw_paths(const ParticleSet& particles, field_core::Random& random) {
  weights_.resize(particles.size());
  for (std::size_t i = 0; i < particles.size(); ++i) weights_[i] = particles[i].weight;
  // As many draws as paths, in random order: path c must not always get the c-th best particle.
  double cumulative = weights_[0];
  std::size_t from = 0;
  drawn_.resize(paths_.size());
  const double offset = random.uniform();
  for (std::size_t c = 0; c < paths_.size(); ++c) {
    const double u = (c + offset) / static_cast<double>(paths_.size());
    while (u >= cumulative && from + 1 < weights_.size()) cumulative += weights_[++from];
    drawn_[c] = static_cast<int>(from);
  }
  for (std::size_t c = drawn_.size() - 1; c > 0; --c)
    std::swap(drawn_[c], drawn_[random.index(c + 1)]);
  for (std::size_t c = 0; c < paths_.size(); ++c) paths_[c] = particles[drawn_[c]];
}

void SamplePathMap::fill_panels(int field, PathPanels& panels) const {
  panels.assimilate(closed_[field]);
  std::vector<const OnlineSparseGp*> maps;
  for (const OnlineSparseGp& map : maps_[field]) maps.push_back(&map);
  extend_by_open_rows(fields_[field].basis, maps, panels);
}

void SamplePathMap::predict(int field, const Eigen::Matrix2Xd& points, const ParticleSet&,
                            Eigen::VectorXd& mean, Eigen::VectorXd& variance) const {
  // In double, whatever the filter itself runs in: this is what users see.
  const SupportBasis& basis = fields_[field].basis;
  const auto panels = make_path_panels(basis, static_cast<int>(paths_.size()), slice_size_, recent_,
                                       Precision::double_precision);
  fill_panels(field, *panels);
  Features features;
  Eigen::Matrix2Xd moments;
  basis.features(points, features);
  panels->add(basis, points, features, 0.0, 0.0, nullptr, moments);
  mean = moments.row(0).transpose();
  variance = (moments.row(1) - moments.row(0).cwiseAbs2()).transpose().cwiseMax(0.0);
}

void SamplePathMap::save(field_core::State& state) const {
  Eigen::MatrixXd states(kStateSize, paths_.size());
  for (std::size_t c = 0; c < paths_.size(); ++c) states.col(c) = pack(paths_[c]);
  state.set("sample_paths", states);
  state.set("steps_in_slice", steps_in_slice_);
  for (std::size_t f = 0; f < fields_.size(); ++f) {
    const auto rows = OnlineSparseGp::number_count(maps_[f][0].support_size(), slice_size_);
    Eigen::MatrixXd numbers(rows, paths_.size());
    for (std::size_t c = 0; c < paths_.size(); ++c) {
      const std::vector<double> all = maps_[f][c].numbers();
      numbers.col(c) = Eigen::Map<const Eigen::VectorXd>(all.data(), rows);
    }
    state.set("map/" + fields_[f].info.name, numbers);
    state.set("closed/" + fields_[f].info.name, closed_[f]);
  }
}

void SamplePathMap::restore(const field_core::State& state) {
  const auto paths = static_cast<Eigen::Index>(paths_.size());
  const Eigen::MatrixXd states = state.matrix("sample_paths", kStateSize, paths);
  const int steps = static_cast<int>(state.scalar("steps_in_slice"));
  std::vector<const Eigen::MatrixXd*> numbers, closed;
  for (std::size_t f = 0; f < fields_.size(); ++f) {
    const int m = static_cast<int>(fields_[f].basis.size());
    const std::string& name = fields_[f].info.name;
    const auto rows = OnlineSparseGp::number_count(m, slice_size_);
    numbers.push_back(&state.matrix("map/" + name, rows, paths));
    closed.push_back(&state.matrix("closed/" + name, OnlineSparseGp::summary_size(m), paths));
  }
  for (Eigen::Index c = 0; c < paths; ++c) paths_[c] = unpack(states.col(c));
  steps_in_slice_ = steps;
  for (std::size_t f = 0; f < fields_.size(); ++f) {
    for (Eigen::Index c = 0; c < paths; ++c) maps_[f][c].restore(numbers[f]->col(c).data());
    closed_[f] = *closed[f];
    fill_panels(static_cast<int>(f), *panels_[f]);
  }
}

}  // namespace gp_localize
