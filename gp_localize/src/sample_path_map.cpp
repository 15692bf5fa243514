#include "sample_path_map.hpp"

#include "gp_localize/resampling.hpp"

namespace gp_localize {

using field_core::SE2;

SamplePathMap::SamplePathMap(const GpLocalizeParams& params, const std::vector<FieldModel>& fields)
    : fields_(fields),
      slice_size_(params.slice_size),
      redraw_(params.redraw_sample_paths),
      paths_(params.sample_paths) {
  for (const int first : first_fields(fields_)) {
    banks_.push_back(make_path_bank(params, fields_[first]));
  }
  moments_.resize(1);
}

void SamplePathMap::restart(const SE2& pose, const Eigen::Matrix3d& covariance,
                            const MotionModel& model, field_core::Random& random) {
  for (RobotState& path : paths_) path = model.draw(pose, covariance, random);
  for (const auto& bank : banks_) bank->restart();
  steps_in_slice_ = 0;
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
  PathBank& total = *banks_.front();
  total.begin(static_cast<int>(particles.size()));
  innovation.mean.assign(observations.size(), 0.0);
  innovation.variance.assign(observations.size(), 0.0);
  const auto together = [&](std::size_t i, std::size_t k) {
    const FieldModel &a = fields_[observations[i].field], &b = fields_[observations[k].field];
    return i == k || (a.group == b.group && a.basis.fields() > 1);
  };
  for (std::size_t k = 0; k < observations.size(); ++k) {
    which_.clear();
    for (std::size_t i = 0; i < observations.size(); ++i) {
      if (together(i, k)) which_.push_back(i);
    }
    if (which_.front() == k) weigh_group(particles, observations, total, innovation);
  }
  total.log_mean(log_likelihood);
}

void SamplePathMap::weigh_group(const ParticleSet& particles,
                                const std::vector<Observation>& observations, PathBank& total,
                                Innovation& innovation) {
  const Observation& first = observations[which_.front()];
  const FieldModel& field = fields_[first.field];
  PathBank& bank = *banks_[field.group];
  if (which_.size() > 1) {
    readings_.clear();
    for (const std::size_t k : which_) {
      const Observation& o = observations[k];
      readings_.push_back({fields_[o.field].member, o.value, o.likelihood_variance});
    }
    bank.add_joint(points_, readings_, total, moments_);
  } else if (field.basis.fields() > 1) {
    field.places(points_, labelled_points_);
    bank.add(labelled_points_, first.value, first.likelihood_variance, total, moments_[0]);
  } else {
    bank.add(points_, first.value, first.likelihood_variance, total, moments_[0]);
  }
  for (std::size_t j = 0; j < which_.size(); ++j) {
    double mean = 0.0, square = 0.0;
    for (std::size_t i = 0; i < particles.size(); ++i) {
      mean += particles[i].weight * moments_[j](0, i);
      square += particles[i].weight * moments_[j](1, i);
    }
    innovation.mean[which_[j]] = mean;
    innovation.variance[which_[j]] = square - mean * mean;
  }
}

void SamplePathMap::learn(const ParticleSet& particles, const SE2& sensor_in_base,
                          const std::vector<Observation>& observations,
                          field_core::Random& random) {
  path_points_.resize(2, paths_.size());
  for (std::size_t c = 0; c < paths_.size(); ++c) {
    path_points_.col(c) = paths_[c].pose * sensor_in_base.translation();
  }
  for (const Observation& o : observations) {
    const FieldModel& field = fields_[o.field];
    PathBank& bank = *banks_[field.group];
    if (field.basis.fields() > 1) {
      field.places(path_points_, labelled_);
      bank.learn(labelled_, o.value, o.noise_variance);
    } else {
      bank.learn(path_points_, o.value, o.noise_variance);
    }
  }
  if (++steps_in_slice_ < slice_size_) return;
  close_slice();
  if (redraw_) redraw_paths(particles, random);
}

void SamplePathMap::close_slice() {
  steps_in_slice_ = 0;
  for (const auto& bank : banks_) bank->close_slice();
}

void SamplePathMap::redraw_paths(const ParticleSet& particles, field_core::Random& random) {
  // As many draws as paths, in random order: path c must not always get the c-th best particle.
  weights_.resize(particles.size());
  for (std::size_t i = 0; i < particles.size(); ++i) weights_[i] = particles[i].weight;
  resample_shuffled(weights_, paths_.size(), random, drawn_);
  for (std::size_t c = 0; c < paths_.size(); ++c) paths_[c] = particles[drawn_[c]];
}

void SamplePathMap::predict(int field, const Eigen::Matrix2Xd& points, const ParticleSet&,
                            Eigen::VectorXd& mean, Eigen::VectorXd& variance) const {
  Eigen::Matrix2Xd moments;
  banks_[fields_[field].group]->predict(fields_[field].places(points), moments);
  mean = moments.row(0).transpose();
  variance = (moments.row(1) - moments.row(0).cwiseAbs2()).transpose().cwiseMax(0.0);
}

void SamplePathMap::save(field_core::State& state) const {
  Eigen::MatrixXd states(kStateSize, paths_.size());
  for (std::size_t c = 0; c < paths_.size(); ++c) states.col(c) = pack(paths_[c]);
  state.set("sample_paths", states);
  state.set("steps_in_slice", steps_in_slice_);
  for (const auto& bank : banks_) bank->save(state);
}

void SamplePathMap::restore(const field_core::State& state, const std::vector<int>&) {
  const auto paths = static_cast<Eigen::Index>(paths_.size());
  const Eigen::MatrixXd states = state.matrix("sample_paths", kStateSize, paths);
  const int steps = static_cast<int>(state.scalar("steps_in_slice"));
  for (const auto& bank : banks_) bank->check(state);
  for (const auto& bank : banks_) bank->restore(state);
  for (Eigen::Index c = 0; c < paths; ++c) paths_[c] = unpack(states.col(c));
  steps_in_slice_ = steps;
}

}  // namespace gp_localize
