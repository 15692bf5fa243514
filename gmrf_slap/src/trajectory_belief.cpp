#include "trajectory_belief.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "field_core/errors.hpp"
#include "site_list.hpp"

namespace gmrf_slap {

using field_core::SE2;
using field_core::UpdateResult;

namespace {
constexpr double kPi = 3.14159265358979323846;
}  // namespace

TrajectoryBelief::TrajectoryBelief(const GmrfSlapParams& params, const FieldBank& fields,
                                   std::uint64_t seed)
    : count_(static_cast<std::size_t>(params.particles)),
      lag_(params.lag),
      sites_(fields.lattice().sites()),
      resample_threshold_(params.resample_threshold),
      noise_scale_(params.likelihood_noise_scale * params.likelihood_noise_scale),
      prune_mass_(params.prune_mass),
      motion_(params.odometry_noise),
      random_(seed),
      poses_(count_),
      log_weights_(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(count_))),
      weights_(log_weights_),
      version_(fields.version()),
      rows_(count_),
      places_(count_) {
  Track track;
  for (const FieldMixture& field : fields.fields()) {
    track.emplace_back(lag_, field.hypotheses());
    theta_.push_back(field.prior);
    shares_.emplace_back(field.hypotheses(), static_cast<Eigen::Index>(count_));
  }
  steps_.assign(static_cast<std::size_t>(lag_), std::vector<unsigned char>(track.size(), 0));
  tracks_.assign(count_, track);
  belief_.particles.resize(count_);
  normalize_weights();
  summarize();
}

void TrajectoryBelief::set_pose(const SE2& mean, const Eigen::Matrix3d& covariance) {
  for (SE2& pose : poses_) pose = SE2(mean.vector() + random_.normal3(covariance));
  log_weights_.setZero();
  normalize_weights();
  summarize();
}

void TrajectoryBelief::scatter(const FieldBank& fields) {
  const Lattice& lattice = fields.lattice();
  const Eigen::Vector2d low = lattice.position(0), high = lattice.position(lattice.sites() - 1);
  const double half = 0.5 * lattice.spacing();
  // Evenly spread (the additive sequence of the plastic number's powers, Roberts 2018, shifted at
  // random): fewer holes than independent draws leave.
  const double u = random_.uniform(), v = random_.uniform(), w = random_.uniform();
  const auto spread = [](double shift, double step, double k, double from, double to) {
    const double x = shift + step * k;
    return from + (to - from) * (x - std::floor(x));
  };
  double k = 0.0;
  for (SE2& pose : poses_) {
    pose = SE2(spread(u, 0.8191725133961645, k, low.x() - half, high.x() + half),
               spread(v, 0.6710436067037893, k, low.y() - half, high.y() + half),
               spread(w, 0.5497004779019703, k, -kPi, kPi));
    k += 1.0;
  }
  log_weights_.setZero();
  normalize_weights();
  summarize();
}

void TrajectoryBelief::predict(const SE2& delta) {
  const auto motion = field_core::OdometryMotion::from(delta);
  for (SE2& pose : poses_) pose = motion_.sample(pose, motion, random_);
  summarize();
}

void TrajectoryBelief::displace(const Eigen::Vector2d& motion, const Eigen::Matrix2d& noise) {
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  covariance.topLeftCorner<2, 2>() = noise;
  for (SE2& pose : poses_) {
    const Eigen::Vector2d d = motion + random_.normal3(covariance).head<2>();
    pose = SE2(pose.x() + d.x(), pose.y() + d.y(), pose.yaw());
  }
  summarize();
}

UpdateResult TrajectoryBelief::observe_position(const FieldBank&, const Eigen::Vector2d& position,
                                                const Eigen::Matrix2d& covariance) {
  const Eigen::Matrix2d information = covariance.inverse();
  const Eigen::Vector2d before = belief_.mean.translation();
  const Eigen::Matrix2d spread = belief_.covariance.topLeftCorner<2, 2>() + covariance;
  const Eigen::Vector2d innovation = position - before;
  for (std::size_t p = 0; p < count_; ++p) {
    const Eigen::Vector2d d = position - poses_[p].translation();
    log_weights_[static_cast<Eigen::Index>(p)] -= 0.5 * d.dot(information * d);
  }
  normalize_weights();
  summarize();
  resample_if_needed();
  return {true, "", innovation.dot(spread.inverse() * innovation), 2};
}

const Eigen::VectorXd& TrajectoryBelief::hypotheses_of(const FieldMixture& field, std::size_t f,
                                                       std::size_t p) const {
  const SuffixProcess& process = tracks_[p][f];
  Eigen::VectorXd& theta = theta_[f];
  for (int l = 0; l < field.hypotheses(); ++l) {
    theta[l] = std::log(field.probability[l]) + process.evidence(l);
  }
  exponentiate_and_normalize(theta);
  return theta;
}

UpdateResult TrajectoryBelief::update(FieldBank& fields,
                                      const std::vector<Observation>& observations,
                                      const SE2& sensor_in_base) {
  bool inside = false;
  for (std::size_t p = 0; p < count_; ++p) {
    places_[p] = poses_[p] * sensor_in_base.translation();
    rows_[p] = fields.row(places_[p]);
    inside = inside || rows_[p].count > 0;
  }
  if (!inside) return UpdateResult::skipped("outside the grid");
  focus(fields, rows_);
  follow(fields);

  UpdateResult result;
  for (const Observation& z : observations) {
    const auto f = static_cast<std::size_t>(z.field);
    const FieldMixture& field = fields.fields()[f];
    double first = 0.0, second = 0.0;  // moments of the predicted measurement
    for (std::size_t p = 0; p < count_; ++p) {
      const Eigen::VectorXd& theta = hypotheses_of(field, f, p);
      const double residual = z.value - field.prior_mean(places_[p]);
      LogSum density;
      for (int l = 0; l < field.hypotheses(); ++l) {
        const auto at = tracks_[p][f].predict(l, field, rows_[p]);
        density.add(std::log(theta[l]) +
                    log_normal(residual - at.mean, at.variance + noise_scale_ * z.noise));
        const double w = weights_[static_cast<Eigen::Index>(p)] * theta[l];
        const double d = residual - at.mean;
        first += w * d;
        second += w * (at.variance + z.noise + d * d);
      }
      log_weights_[static_cast<Eigen::Index>(p)] += density.value();
    }
    result.nis += first * first / (second - first * first);
    ++result.nis_dof;
  }
  append(fields, observations);
  normalize_weights();
  summarize();
  if (static_cast<int>(held_) >= lag_) advance(fields);
  resample_if_needed();
  return result;
}

void TrajectoryBelief::append(const FieldBank& fields,
                              const std::vector<Observation>& observations) {
  std::vector<unsigned char>& step = steps_[held_++];
  std::fill(step.begin(), step.end(), 0);
  for (const Observation& z : observations) {
    const auto f = static_cast<std::size_t>(z.field);
    step[f] = 1;
    for (std::size_t p = 0; p < count_; ++p) {
      tracks_[p][f].append(rows_[p], z.value - fields.fields()[f].prior_mean(places_[p]), z.noise);
    }
  }
}

void TrajectoryBelief::merge_oldest(FieldBank& fields, int field, int entry) const {
  const auto f = static_cast<std::size_t>(field);
  FieldMixture& mixture = fields.fields()[f];
  for (int l = 0; l < mixture.hypotheses(); ++l) {
    mixture_.clear();
    for (std::size_t p = 0; p < count_; ++p) {
      const SuffixProcess& process = tracks_[p][f];
      mixture_.add(process.row(entry), shares_[f](l, static_cast<Eigen::Index>(p)),
                   process.residual(entry));
    }
    mixture_.condition(*mixture.given[static_cast<std::size_t>(l)], tracks_[0][f].noise(entry),
                       {prune_mass_, 0.0});
  }
}

void TrajectoryBelief::focus(FieldBank& fields, const std::vector<SiteRow>& rows) const {
  if (!fields.needs_focus()) return;
  const std::vector<int> ahead = sites_of(rows);
  std::vector<int> sites = ahead;
  for (const Track& track : tracks_) {
    for (const SuffixProcess& process : track) {
      for (int i = 0; i < process.size(); ++i) add_sites(process.row(i), sites);
    }
  }
  sort_unique(sites);
  fields.focus(sites, ahead);
}

void TrajectoryBelief::merge(FieldBank& fields, int steps) const {
  for (std::size_t f = 0; f < fields.fields().size(); ++f) {
    FieldMixture& mixture = fields.fields()[f];
    for (std::size_t p = 0; p < count_; ++p) {
      const auto at = static_cast<Eigen::Index>(p);
      shares_[f].col(at) = weights_[at] * hypotheses_of(mixture, f, p);
    }
    int entry = 0;
    for (int step = 0; step < steps; ++step) {
      if (steps_[static_cast<std::size_t>(step)][f]) {
        merge_oldest(fields, static_cast<int>(f), entry++);
      }
    }
  }
}

void TrajectoryBelief::merge_into(FieldBank& fields) const {
  focus(fields, {});
  merge(fields, static_cast<int>(held_));
  for (std::size_t f = 0; f < fields.fields().size(); ++f) {
    FieldMixture& mixture = fields.fields()[f];
    mixture.probability = theta_posterior(mixture, f);
  }
  fields.changed();
}

Eigen::VectorXd TrajectoryBelief::theta_posterior(const FieldMixture& field,
                                                  std::size_t index) const {
  Eigen::VectorXd probability = Eigen::VectorXd::Zero(field.hypotheses());
  for (std::size_t p = 0; p < count_; ++p) {
    probability += weights_[static_cast<Eigen::Index>(p)] * hypotheses_of(field, index, p);
  }
  return probability / probability.sum();
}

Eigen::VectorXd TrajectoryBelief::field_mean(const FieldMixture& field, std::size_t index) const {
  Eigen::VectorXd probability = Eigen::VectorXd::Zero(field.hypotheses());
  std::vector<Eigen::VectorXd> site_weights(field.thetas.size(), Eigen::VectorXd::Zero(sites_));
  for (std::size_t p = 0; p < count_; ++p) {
    const Eigen::VectorXd& theta = hypotheses_of(field, index, p);
    for (int l = 0; l < field.hypotheses(); ++l) {
      const double w = weights_[static_cast<Eigen::Index>(p)] * theta[l];
      probability[l] += w;
      tracks_[p][index].add_site_weights(l, w, site_weights[static_cast<std::size_t>(l)]);
    }
  }
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(sites_);
  for (std::size_t l = 0; l < field.thetas.size(); ++l) {
    mean += probability[static_cast<Eigen::Index>(l)] * field.given[l]->mean();
    mean += field.given[l]->multiply(site_weights[l]);
  }
  return mean;
}

void TrajectoryBelief::advance(FieldBank& fields) {
  const int steps = std::max(1, lag_ / 4);
  merge(fields, steps);
  for (std::size_t f = 0; f < fields.fields().size(); ++f) {
    FieldMixture& mixture = fields.fields()[f];
    int entries = 0;
    for (int step = 0; step < steps; ++step) entries += steps_[static_cast<std::size_t>(step)][f];
    ratio_.assign(mixture.thetas.size(), LogSum());
    before_.resize(mixture.thetas.size());
    for (std::size_t p = 0; p < count_; ++p) {
      SuffixProcess& process = tracks_[p][f];
      for (std::size_t l = 0; l < before_.size(); ++l) {
        before_[l] = process.evidence(static_cast<int>(l));
      }
      process.rebuild(entries, mixture);
      const double log_weight = std::log(weights_[static_cast<Eigen::Index>(p)]);
      for (int l = 0; l < mixture.hypotheses(); ++l) {
        const auto at = static_cast<std::size_t>(l);
        ratio_[at].add(log_weight + before_[at] - process.evidence(l));
      }
    }
    // What the measurements that left the tracks said about theta stays with the fields.
    Eigen::VectorXd& theta = theta_[f];
    for (int l = 0; l < mixture.hypotheses(); ++l) {
      theta[l] = std::log(mixture.probability[l]) + ratio_[static_cast<std::size_t>(l)].value();
    }
    exponentiate_and_normalize(theta);
    mixture.probability = theta.cwiseMax(kSmallestProbability);
    mixture.probability /= mixture.probability.sum();
  }
  std::rotate(steps_.begin(), steps_.begin() + steps, steps_.end());
  held_ -= static_cast<std::size_t>(steps);
  fields.changed();
  version_ = fields.version();
}

void TrajectoryBelief::follow(const FieldBank& fields) {
  if (version_ == fields.version()) return;
  for (std::size_t p = 0; p < count_; ++p) {
    for (std::size_t f = 0; f < fields.fields().size(); ++f) {
      tracks_[p][f].rebuild(0, fields.fields()[f]);
    }
  }
  version_ = fields.version();
}

void TrajectoryBelief::normalize_weights() {
  log_weights_.array() -= log_weights_.maxCoeff();
  weights_ = log_weights_.array().exp();
  weights_ /= weights_.sum();
}

void TrajectoryBelief::summarize() {
  for (std::size_t p = 0; p < count_; ++p) {
    belief_.particles[p] = {poses_[p], weights_[static_cast<Eigen::Index>(p)]};
  }
  field_core::summarize_particles(belief_.particles, belief_.mean, belief_.covariance);
}

void TrajectoryBelief::resample_if_needed() {
  const double effective = 1.0 / weights_.squaredNorm();
  if (effective >= resample_threshold_ * static_cast<double>(count_)) return;
  systematic_offspring(weights_, random_.uniform(), ancestors_);
  // Survivors stay where they are; only their further copies move into the places of the dead.
  std::size_t dead = 0;
  for (std::size_t p = 0; p < count_; ++p) {
    for (int copy = 1; copy < ancestors_[p]; ++copy) {
      while (ancestors_[dead] != 0) ++dead;
      poses_[dead] = poses_[p];
      for (std::size_t f = 0; f < tracks_[p].size(); ++f) tracks_[dead][f].copy_from(tracks_[p][f]);
      ++dead;
    }
  }
  log_weights_.setZero();
  normalize_weights();
}

}  // namespace gmrf_slap
