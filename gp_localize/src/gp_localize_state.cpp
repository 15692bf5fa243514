// Saving and restoring the whole filter.
#include <numeric>

#include "field_core/errors.hpp"
#include "gp_localize/gp_localize.hpp"
#include "gp_localize/resampling.hpp"

namespace gp_localize {

using field_core::SE2;

field_core::State GpLocalize::state() const {
  field_core::State state(kName, kStateVersion);
  Eigen::MatrixXd particles(kStateSize + 1, particles_.size());
  for (std::size_t i = 0; i < particles_.size(); ++i) {
    particles.col(i) << pack(particles_[i]), particles_[i].weight;
  }
  state.set("particles", particles);
  state.set_text("random", random_.state());
  state.set_text("stamp_ns", std::to_string(stamp_.count()));
  state.set("mean", Eigen::MatrixXd(mean_.vector()));
  state.set("covariance", Eigen::MatrixXd(covariance_));
  state.set("updated", updated_ ? 1.0 : 0.0);
  state.set("moved", Eigen::MatrixXd(Eigen::Vector2d(moved_distance_, moved_angle_)));
  state.set("health", health_.numbers());
  lineage_.save(state);
  state.set("known_map", params_.known_map() ? 1.0 : 0.0);
  map_->save(state);
  return state;
}

void GpLocalize::restore(const field_core::State& state) {
  state.require(kName, kStateVersion);
  if (params_.known_map() && state.scalar("known_map") == 0.0) return restore_map(state);
  const Eigen::MatrixXd particles = state.matrix("particles", kStateSize + 1, -1);
  if (particles.cols() == 0 || particles.cols() > params_.particles ||
      (params_.adaptive.min_particles == 0 && particles.cols() != params_.particles)) {
    throw field_core::DataError("the state has " + std::to_string(particles.cols()) +
                                " particles, the configuration " +
                                std::to_string(params_.particles) + "; make them the same");
  }
  const Eigen::MatrixXd mean = state.matrix("mean", 3, 1), moved = state.matrix("moved", 2, 1);
  const Eigen::MatrixXd covariance = state.matrix("covariance", 3, 3);
  const Eigen::MatrixXd health = state.matrix("health", health_.number_count(), 1);
  const bool updated = state.scalar("updated") != 0.0;
  const auto stamp = field_core::Stamp(std::stoll(state.text("stamp_ns")));
  field_core::Random random(seed_);
  random.restore(state.text("random"));
  Lineage lineage = lineage_;
  lineage.restore(state, particles.cols());
  std::vector<int> each(particles.cols());
  std::iota(each.begin(), each.end(), 0);
  map_->restore(state, each);  // the last that can fail
  particles_.resize(each.size());
  for (Eigen::Index i = 0; i < particles.cols(); ++i) {
    particles_[i] = {unpack(particles.col(i).head<kStateSize>()), particles(kStateSize, i)};
  }
  random_ = random;
  stamp_ = stamp;
  mean_ = SE2(Eigen::Vector3d(mean));
  covariance_ = covariance;
  health_.restore(health);
  lineage_ = lineage;
  updated_ = updated;
  moved_distance_ = moved(0);
  moved_angle_ = moved(1);
}

/// The maps of the saved particles, by their weights, for particles at the start.
void GpLocalize::restore_map(const field_core::State& state) {
  const Eigen::MatrixXd particles = state.matrix("particles", kStateSize + 1, -1);
  std::vector<double> weights(particles.cols());
  for (Eigen::Index i = 0; i < particles.cols(); ++i) weights[i] = particles(kStateSize, i);
  std::vector<int> ancestors;
  low_variance_resample(weights, 0.5, params_.particles, ancestors);
  map_->restore(state, ancestors);  // the last that can fail
  random_ = field_core::Random(seed_);
  draw_start();
  map_->relocate(particles_, random_);
  map_->keep_as_known();
}

}  // namespace gp_localize
