#include "gp_localize/gp_localize.hpp"

#include <algorithm>
#include <cmath>

#include "gp_localize/resampling.hpp"

namespace gp_localize {

using field_core::SE2;
using field_core::UpdateResult;

namespace {

CalibrationParams calibration_params(const GpLocalizeParams& p) {
  const auto& n = p.odometry_noise;
  const bool exact = n.alpha1 == 0.0 && n.alpha2 == 0.0 && n.alpha3 == 0.0 && n.alpha4 == 0.0;
  return exact ? CalibrationParams{} : p.odom_calibration;
}

}  // namespace

GpLocalize::GpLocalize(const Params& params, std::uint64_t seed)
    : params_(params),
      seed_(seed),
      random_(seed),
      motion_model_{field_core::OdometryMotionModel(params.odometry_noise),
                    OdometryCalibrationModel(calibration_params(params))},
      models_(make_field_models(params)),
      map_(make_map_model(params, models_)),
      health_(params.lost),
      lineage_(params.diversity, params.particles),
      bins_(params.particles) {
  for (const FieldModel& model : models_) infos_.push_back(model.info);
  reserve();
  reset();
}

/// For as many particles as there may ever be: their number varies during the run.
void GpLocalize::reserve() {
  const auto most = static_cast<std::size_t>(params_.particles);
  particles_.reserve(most);
  resampled_.reserve(most);
  weighted_poses_.reserve(most);
  poses_.reserve(most);
  for (auto* numbers : {&log_weights_, &cumulative_}) numbers->reserve(most);
  ancestors_.reserve(most);
}

void GpLocalize::reset() {
  random_ = field_core::Random(seed_);
  const SE2 start = params_.initial_pose();
  map_->restart(start, params_.initial_covariance(), motion_model_, random_);
  draw_start();
}

void GpLocalize::draw_start() {
  const SE2 start = params_.initial_pose();
  particles_.resize(params_.particles);
  for (Particle& particle : particles_) {
    particle = {motion_model_.draw(start, params_.initial_covariance(), random_),
                1.0 / params_.particles};
  }
  stamp_ = field_core::Stamp(0);
  updated_ = false;
  moved_distance_ = moved_angle_ = 0.0;
  health_.restart();
  lineage_.restart(particles_.size());
  summarize();
}

void GpLocalize::set_pose(const SE2& mean, const Eigen::Matrix3d& covariance) {
  for (Particle& particle : particles_) {  // what was learned of the odometry stays
    particle.pose = SE2(mean.vector() + random_.normal3(covariance));
    particle.weight = 1.0 / static_cast<double>(particles_.size());
  }
  map_->relocate(particles_, random_);
  health_.restart();
  summarize();
}

void GpLocalize::scatter(Particle& particle) {
  const field_core::MapRegion r = map_region();
  particle.pose = SE2(random_.uniform(r.x_min, r.x_max), random_.uniform(r.y_min, r.y_max),
                      random_.uniform(-M_PI, M_PI));
}

void GpLocalize::scatter() {
  // As many as there may be, each with a map that one of them has now.
  ancestors_.resize(params_.particles);
  const std::size_t count = particles_.size();
  for (std::size_t i = 0; i < ancestors_.size(); ++i) {
    ancestors_[i] = static_cast<int>(i * count / ancestors_.size());
  }
  become_children();
  for (Particle& particle : particles_) scatter(particle);
  map_->relocate(particles_, random_);
  health_.restart();
  summarize();
}

void GpLocalize::predict(const field_core::OdometryIncrement& increment) {
  const auto motion = field_core::OdometryMotion::from(increment.delta);
  map_->move(motion, motion_model_, random_);
  for (auto& particle : particles_) {
    motion_model_.move(motion, particle, random_);
  }
  moved_distance_ += std::abs(motion.trans);
  moved_angle_ += std::abs(increment.delta.yaw());
  stamp_ = increment.to;
  summarize();
}

bool GpLocalize::moved_enough() const {
  const bool gated = params_.update_min_d > 0.0 || params_.update_min_a > 0.0;
  if (!gated || !updated_) return true;
  return (params_.update_min_d > 0.0 && moved_distance_ >= params_.update_min_d) ||
         (params_.update_min_a > 0.0 && moved_angle_ >= params_.update_min_a);
}

void GpLocalize::collect_observations(const field_core::Sample& sample) {
  observations_.clear();
  const double scale = params_.likelihood_noise_scale * params_.likelihood_noise_scale;
  for (const field_core::Reading& reading : sample.readings) {
    if (reading.field < 0 || reading.field >= static_cast<int>(models_.size())) continue;
    const FieldModel& model = models_[reading.field];
    const double noise = reading.variance > 0.0 ? reading.variance : model.noise_variance;
    observations_.push_back(
        {reading.field, reading.value - model.mean, noise, scale * noise, sample.stamp});
  }
}

UpdateResult GpLocalize::update(const field_core::Sample& sample) {
  collect_observations(sample);
  if (observations_.empty()) return UpdateResult::skipped("no known field");
  if (!moved_enough()) return UpdateResult::skipped("not moved enough");
  map_->weigh(particles_, sample.sensor_in_base, observations_, log_weights_, innovation_);
  const UpdateResult result = normalized_innovation();
  const double exponent =
      params_.likelihood_exponent * (rests_on_paths() ? lineage_.tempering(particles_) : 1.0);
  for (std::size_t i = 0; i < log_weights_.size(); ++i) {
    log_weights_[i] = exponent * log_weights_[i] + std::log(particles_[i].weight);
  }
  if (!normalize_log_weights(log_weights_)) {
    return UpdateResult::skipped("no particle explains the measurement");
  }
  for (std::size_t i = 0; i < particles_.size(); ++i) particles_[i].weight = log_weights_[i];
  map_->accept(observations_);
  const double unknown = rests_on_paths() ? map_->unknown(particles_, observations_) : 1.0;
  if (params_.mode != Mode::localization) {
    map_->learn(particles_, sample.sensor_in_base, observations_, random_);
  }
  summarize();
  health_.add(result, covariance_);
  lineage_.step(unknown);
  resample_if_needed();
  updated_ = true;
  moved_distance_ = moved_angle_ = 0.0;
  stamp_ = sample.stamp;
  return result;
}

field_core::Health GpLocalize::health() const {
  field_core::Health health = health_.health();
  if (rests_on_paths()) health.paths_left = lineage_.paths_left(particles_);
  return health;
}

UpdateResult GpLocalize::normalized_innovation() const {
  UpdateResult result;
  for (std::size_t k = 0; k < observations_.size(); ++k) {
    const double error = observations_[k].value - innovation_.mean[k];
    result.nis += error * error / innovation_.variance[k];
  }
  result.nis_dof = static_cast<int>(observations_.size());
  return result;
}

/// `log_weights_` holds the particles' normalized weights here.
void GpLocalize::resample_if_needed() {
  const double count = static_cast<double>(particles_.size());
  const bool recover =
      params_.known_map() && params_.lost.recovery_share > 0.0 && health_.contradicted();
  if (!recover && effective_sample_size(log_weights_) >= params_.resample_threshold * count) {
    return;
  }
  choose_ancestors();
  become_children();
  if (!recover) return;
  for (Particle& particle : particles_) {  // augmented Monte Carlo localization
    if (random_.uniform() < params_.lost.recovery_share) scatter(particle);
  }
  map_->relocate(particles_, random_);
}

void GpLocalize::choose_ancestors() {
  const AdaptiveParams& a = params_.adaptive;
  if (a.min_particles == 0) {
    low_variance_resample(log_weights_, random_.uniform(), particles_.size(), ancestors_);
    return;
  }
  poses_.resize(particles_.size());
  for (std::size_t i = 0; i < poses_.size(); ++i) poses_[i] = particles_[i].pose;
  kld_resample(log_weights_, poses_, {a.min_particles, params_.particles, a.kld_err, a.kld_z},
               bins_, random_, cumulative_, ancestors_);
}

/// Each particle becomes a copy of its ancestor; all weights are equal then.
void GpLocalize::become_children() {
  resampled_.resize(ancestors_.size());
  for (std::size_t i = 0; i < resampled_.size(); ++i) {
    resampled_[i] = particles_[ancestors_[i]];
    resampled_[i].weight = 1.0 / static_cast<double>(ancestors_.size());
  }
  resampled_.swap(particles_);
  map_->resampled(ancestors_);
  lineage_.resampled(ancestors_);
}

/// From the weighted particles: resampling only adds variance.
void GpLocalize::summarize() {
  weighted_poses_.resize(particles_.size());
  for (std::size_t i = 0; i < particles_.size(); ++i) {
    weighted_poses_[i] = {particles_[i].pose, particles_[i].weight};
  }
  summarize_particles(weighted_poses_, mean_, covariance_);
}

field_core::Belief GpLocalize::belief() const {
  field_core::Belief belief{stamp_, mean_, covariance_, {}};
  for (const Particle& p : particles_) belief.particles.push_back({p.pose, p.weight});
  return belief;
}

OdometryCalibration GpLocalize::calibration() const {
  OdometryCalibration mean{0.0, 0.0, 0.0};
  for (const Particle& p : particles_) {
    mean.translation += p.weight * p.calibration.translation;
    mean.rotation += p.weight * p.calibration.rotation;
    mean.drift += p.weight * p.calibration.drift;
  }
  return mean;
}

field_core::FieldPrediction GpLocalize::predict_field(const Eigen::Matrix2Xd& points) const {
  const auto count = static_cast<Eigen::Index>(models_.size());
  field_core::FieldPrediction p;
  p.mean.resize(count, points.cols());
  p.variance.resize(count, points.cols());
  p.prior_variance.resize(count);
  Eigen::VectorXd mean, variance;
  for (Eigen::Index f = 0; f < count; ++f) {
    const FieldModel& model = models_[f];
    map_->predict(static_cast<int>(f), points, particles_, mean, variance);
    p.mean.row(f) = mean.transpose().array() + model.mean;
    const FieldVariances prior = map_->variances(static_cast<int>(f), particles_);
    p.variance.row(f) = variance.transpose().array() + prior.noise;
    p.prior_variance[f] = prior.signal + prior.noise;
  }
  return p;
}

field_core::MapRegion GpLocalize::map_region() const {
  field_core::MapRegion region;
  const FieldModel& model = models_.front();
  const Eigen::Vector2d margin = model.basis.kernel().length_scales();
  const auto include = [&](const Eigen::Vector2d& p) {
    region.x_min = std::min(region.x_min, p.x() - margin.x());
    region.y_min = std::min(region.y_min, p.y() - margin.y());
    region.x_max = std::max(region.x_max, p.x() + margin.x());
    region.y_max = std::max(region.y_max, p.y() + margin.y());
  };
  if (params_.support.selection != SupportSelection::explicit_points) {
    const auto& r = params_.support.region;
    region = {r[0], r[1], r[2], r[3]};
  } else {  // explicit points: their box, and one length scale around it
    region = {INFINITY, INFINITY, -INFINITY, -INFINITY};
    const Eigen::Matrix2Xd support = model.basis.support();
    for (const Eigen::Vector2d p : support.colwise()) include(p);
  }
  const Eigen::Matrix2Xd grown = map_->grown_support();
  for (const Eigen::Vector2d p : grown.colwise()) include(p);
  return region;
}

}  // namespace gp_localize
