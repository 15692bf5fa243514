#include "lattice_belief.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "field_core/errors.hpp"
#include "site_list.hpp"
#include "weights.hpp"

namespace gmrf_slap {

using field_core::SE2;
using field_core::UpdateResult;

namespace {
constexpr double kRing = 1.0;  // width of the ring whose mass is measured [standard deviations]

Eigen::Matrix2d inverse(const Eigen::Matrix2d& m) { return m.inverse(); }
}  // namespace

LatticeBelief::LatticeBelief(const GmrfSlapParams& params, const FieldBank& fields)
    : lattice_(fields.lattice()),
      collapse_(params.position_belief == PositionBelief::gaussian),
      sigmas_(params.candidate_sigmas),
      noise_scale_(params.likelihood_noise_scale * params.likelihood_noise_scale),
      thrift_{params.prune_mass, params.merge_loss},
      motion_(params.odometry_noise) {}

void LatticeBelief::set_pose(const SE2& mean, const Eigen::Matrix3d& covariance) {
  mean_ = mean.translation();
  yaw_ = mean.yaw();
  covariance_ = covariance.topLeftCorner<2, 2>();
  yaw_variance_ = covariance(2, 2);
  yaw_covariance_ = covariance.block<1, 2>(2, 0);
  weights_.resize(0);
  moved_ = true;
}

void LatticeBelief::scatter(const FieldBank&) {
  const Eigen::Vector2d low = lattice_.position(0), high = lattice_.position(lattice_.sites() - 1);
  const Eigen::Vector2d size = (high - low).array() + lattice_.spacing();
  // A Gaussian as wide as the grid is nearly flat on it; yaw uniform on the
  // circle has this variance.
  const Eigen::Matrix2d covariance = size.array().square().matrix().asDiagonal();
  set_pose(SE2(0.5 * (low.x() + high.x()), 0.5 * (low.y() + high.y()), yaw_),
           Eigen::Matrix3d::Zero());
  covariance_ = covariance;
  yaw_variance_ = 3.2898681336964529;  // pi^2 / 3
}

LatticeBelief::YawModel LatticeBelief::yaw_model() const {
  const Eigen::Matrix2d known =
      covariance_ + field_core::kMinimumPoseVariance * Eigen::Matrix2d::Identity();
  const Eigen::RowVector2d slope = yaw_covariance_ * known.inverse();
  return {slope, std::max(yaw_variance_ - slope.dot(yaw_covariance_), 0.0)};
}

double LatticeBelief::yaw_at(const Eigen::Vector2d& position, const YawModel& model) const {
  return yaw_ + model.slope.dot((position - mean_).transpose());
}

void LatticeBelief::predict(const SE2& delta) {
  const auto motion = field_core::OdometryMotion::from(delta);
  const auto prediction = motion_.predict(SE2(mean_.x(), mean_.y(), yaw_), motion);
  const YawModel model = yaw_model();
  const Eigen::Vector2d d = delta.translation();
  // What a candidate's own move does not know: odometry noise, and yaw given
  // the position.
  const Eigen::Vector2d turn = prediction.pose_jacobian.block<2, 1>(0, 2);
  moved_noise_ += (prediction.motion_jacobian * prediction.motion_noise *
                   prediction.motion_jacobian.transpose())
                      .topLeftCorner<2, 2>() +
                  model.variance * turn * turn.transpose();
  for (Eigen::Vector2d& place : places_) {
    place += SE2(0.0, 0.0, yaw_at(place, model)).rotation() * d;
  }
  Eigen::Matrix3d covariance;
  covariance << covariance_, yaw_covariance_.transpose(), yaw_covariance_, yaw_variance_;
  covariance = prediction.covariance(covariance);
  covariance = (0.5 * (covariance + covariance.transpose())).eval();  // rounding
  mean_ = prediction.mean.translation();
  yaw_ = prediction.mean.yaw();
  covariance_ = covariance.topLeftCorner<2, 2>();
  yaw_covariance_ = covariance.block<1, 2>(2, 0);
  yaw_variance_ = covariance(2, 2);
  moved_ = moved_ || !d.isZero(0.0);
}

void LatticeBelief::displace(const Eigen::Vector2d& motion, const Eigen::Matrix2d& noise) {
  for (Eigen::Vector2d& place : places_) place += motion;
  mean_ += motion;
  covariance_ += noise;
  moved_noise_ += noise;
  moved_ = moved_ || !motion.isZero(0.0) || !noise.isZero(0.0);
}

double LatticeBelief::prior_density(const Eigen::Vector2d& site,
                                    const Eigen::Matrix2d& information) const {
  if (collapse_ || weights_.size() == 0) {
    const Eigen::Vector2d d = site - mean_;
    return std::exp(-0.5 * d.dot(information * d));
  }
  double sum = 0.0;
  for (std::size_t k = 0; k < places_.size(); ++k) {
    const Eigen::Vector2d d = site - places_[k];
    const double squared = d.dot(information * d);
    if (squared < 60.0) sum += weights_[static_cast<Eigen::Index>(k)] * std::exp(-0.5 * squared);
  }
  return sum;
}

bool LatticeBelief::choose_candidates(const Fix& fix) {
  const double h = lattice_.spacing();
  const Eigen::Matrix2d rounding = h * h / 12.0 * Eigen::Matrix2d::Identity();
  const Eigen::Matrix2d predicted = inverse(covariance_ + rounding);
  const Eigen::Matrix2d fused_information = predicted + fix.information;
  const Eigen::Matrix2d fused = inverse(fused_information);
  const Eigen::Vector2d centre = fused * (predicted * mean_ + fix.information * fix.position);
  const Eigen::Matrix2d kernel =
      collapse_ || weights_.size() == 0 ? predicted : inverse(moved_noise_ + rounding);
  const double reach = sigmas_ + kRing;
  const Eigen::Vector2d half = reach * fused.diagonal().cwiseSqrt().array() + h;
  const Eigen::Vector2d low = (centre - half - lattice_.origin()) / h;
  const Eigen::Vector2d high = (centre + half - lattice_.origin()) / h;
  sites_.clear();
  chosen_.clear();
  double ring = 0.0;
  const auto first = [](double x) { return static_cast<int>(std::max(0.0, std::ceil(x))); };
  const auto last = [](double x, int n) {
    return static_cast<int>(std::min(n - 1.0, std::floor(x)));
  };
  for (int j = first(low.y()); j <= last(high.y(), lattice_.ny()); ++j) {
    for (int i = first(low.x()); i <= last(high.x(), lattice_.nx()); ++i) {
      const Eigen::Vector2d site = lattice_.position(lattice_.site(i, j));
      const Eigen::Vector2d d = site - centre;
      const double squared = d.dot(fused_information * d);
      if (squared > reach * reach) continue;
      const Eigen::Vector2d e = site - fix.position;
      const double p = prior_density(site, kernel) * std::exp(-0.5 * e.dot(fix.information * e));
      if (squared > sigmas_ * sigmas_) {
        ring += p;
      } else if (p > 0.0) {
        sites_.push_back(site);
        chosen_.push_back(p);
      }
    }
  }
  if (sites_.empty()) return false;
  const Eigen::Map<const Eigen::VectorXd> p(chosen_.data(),
                                            static_cast<Eigen::Index>(chosen_.size()));
  const double total = p.sum();
  left_out_ = ring / (total + ring);
  places_ = sites_;
  weights_ = p / total;
  moved_noise_.setZero();
  moved_ = false;
  return true;
}

UpdateResult LatticeBelief::observe_position(const FieldBank&, const Eigen::Vector2d& position,
                                             const Eigen::Matrix2d& covariance) {
  const Eigen::Vector2d innovation = position - mean_;
  const double nis = innovation.dot(inverse(covariance_ + covariance) * innovation);
  if (!choose_candidates({position, inverse(covariance)})) {
    return UpdateResult::skipped("outside the grid");
  }
  take_moments();
  return {true, "", nis, 2};
}

UpdateResult LatticeBelief::update(FieldBank& fields, const std::vector<Observation>& observations,
                                   const SE2& sensor_in_base) {
  if ((moved_ || weights_.size() == 0) && !choose_candidates({})) {
    return UpdateResult::skipped("outside the grid");
  }
  const YawModel model = yaw_model();
  rows_.clear();
  sites_.clear();  // now: where the sensor is
  for (const Eigen::Vector2d& place : places_) {
    const SE2 base(place.x(), place.y(), yaw_at(place, model));
    sites_.push_back(base * sensor_in_base.translation());
    rows_.push_back(fields.row(sites_.back()));
  }
  if (fields.needs_focus()) {
    const std::vector<int> sites = sites_of(rows_);
    fields.focus(sites, sites);
  }
  const UpdateResult result = weigh(fields, observations);
  const LeftOut left_out = assimilate(fields, observations);
  left_out_ += left_out.mass;
  left_out_information_ = left_out.information;
  take_moments();
  return result;
}

UpdateResult LatticeBelief::weigh(const FieldBank& fields,
                                  const std::vector<Observation>& observations) {
  const auto count = static_cast<Eigen::Index>(places_.size());
  mean_buffer_.resize(places_.size());
  variance_buffer_.resize(places_.size());
  joint_.weights = weights_;
  joint_.fields.resize(observations.size());
  UpdateResult result;
  for (std::size_t o = 0; o < observations.size(); ++o) {
    const Observation& z = observations[o];
    const FieldMixture& field = fields.fields()[static_cast<std::size_t>(z.field)];
    JointPosterior::Field& joint = joint_.fields[o];
    joint.probability = field.probability;
    joint.log_density.resize(field.hypotheses(), count);
    double first = 0.0, second = 0.0;  // moments of the predicted measurement
    for (int l = 0; l < field.hypotheses(); ++l) {
      const auto at = static_cast<std::size_t>(l);
      field.given[at]->predict(rows_.data(), static_cast<int>(count), mean_buffer_.data(),
                               variance_buffer_.data());
      for (Eigen::Index k = 0; k < count; ++k) {
        const auto kk = static_cast<std::size_t>(k);
        const double variance =
            rows_[kk].count > 0 ? variance_buffer_[kk] : field.prior_variance[at];
        const double d = z.value - field.prior_mean(sites_[kk]) - mean_buffer_[kk];
        joint.log_density(l, k) = log_normal(d, variance + noise_scale_ * z.noise);
        const double w = weights_[k] * field.probability[l];
        first += w * d;
        second += w * (variance + z.noise + d * d);
      }
    }
    result.nis += first * first / (second - first * first);
    ++result.nis_dof;
  }
  joint_.compute();
  weights_ = joint_.weights;
  return result;
}

LeftOut LatticeBelief::assimilate(FieldBank& fields, const std::vector<Observation>& observations) {
  LeftOut most;
  for (std::size_t o = 0; o < observations.size(); ++o) {
    const Observation& z = observations[o];
    FieldMixture& field = fields.fields()[static_cast<std::size_t>(z.field)];
    field.probability = joint_.fields[o].probability;
    for (int l = 0; l < field.hypotheses(); ++l) {
      mixture_.clear();
      for (std::size_t k = 0; k < places_.size(); ++k) {
        mixture_.add(rows_[k], joint_.fields[o].share(l, static_cast<Eigen::Index>(k)),
                     z.value - field.prior_mean(sites_[k]));
      }
      GaussianField& given = *field.given[static_cast<std::size_t>(l)];
      const LeftOut out = mixture_.condition(given, z.noise, thrift_);
      most.mass = std::max(most.mass, out.mass);
      most.information = std::max(most.information, out.information);
    }
  }
  fields.changed();
  return most;
}

void LatticeBelief::take_moments() {
  const YawModel model = yaw_model();
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
  for (std::size_t k = 0; k < places_.size(); ++k) {
    mean += weights_[static_cast<Eigen::Index>(k)] * places_[k];
  }
  for (std::size_t k = 0; k < places_.size(); ++k) {
    const Eigen::Vector2d d = places_[k] - mean;
    second += weights_[static_cast<Eigen::Index>(k)] * (d * d.transpose());
  }
  yaw_ = field_core::wrap_angle(yaw_at(mean, model));
  mean_ = mean;
  covariance_ = 0.5 * (second + second.transpose());  // rounding
  yaw_covariance_ = model.slope * covariance_;
  yaw_variance_ = model.variance + model.slope.dot(yaw_covariance_);
}

field_core::Belief LatticeBelief::belief() const {
  field_core::Belief belief;
  belief.mean = SE2(mean_.x(), mean_.y(), yaw_);
  belief.covariance << covariance_, yaw_covariance_.transpose(), yaw_covariance_, yaw_variance_;
  // Sites stand for the squares around them.
  const double rounding = lattice_.spacing() * lattice_.spacing() / 12.0;
  belief.covariance.diagonal().head<2>().array() += rounding;
  belief.covariance.diagonal().array() += field_core::kMinimumPoseVariance;
  const YawModel model = yaw_model();
  for (std::size_t k = 0; k < static_cast<std::size_t>(weights_.size()); ++k) {
    const Eigen::Vector2d& place = places_[k];
    belief.particles.push_back(
        {SE2(place.x(), place.y(), yaw_at(place, model)), weights_[static_cast<Eigen::Index>(k)]});
  }
  return belief;
}

void LatticeBelief::save(field_core::State& state, const std::string& prefix) const {
  Eigen::MatrixXd places(2, weights_.size());
  for (Eigen::Index k = 0; k < places.cols(); ++k) {
    places.col(k) = places_[static_cast<std::size_t>(k)];
  }
  state.set(prefix + "places", places);
  state.set(prefix + "weights", weights_);
  state.set(prefix + "mean", mean_);
  state.set(prefix + "covariance", covariance_);
  state.set(prefix + "moved_noise", moved_noise_);
  Eigen::VectorXd rest(6);
  rest << yaw_, yaw_variance_, yaw_covariance_[0], yaw_covariance_[1], moved_, left_out_;
  state.set(prefix + "rest", rest);
}

void LatticeBelief::restore(const field_core::State& state, const std::string& prefix,
                            const FieldBank&) {
  const Eigen::MatrixXd places = state.matrix(prefix + "places", 2, -1);
  const Eigen::MatrixXd weights = state.matrix(prefix + "weights", places.cols(), -1);
  const Eigen::MatrixXd mean = state.matrix(prefix + "mean", 2, 1);
  const Eigen::MatrixXd covariance = state.matrix(prefix + "covariance", 2, 2);
  const Eigen::MatrixXd moved_noise = state.matrix(prefix + "moved_noise", 2, 2);
  const Eigen::MatrixXd rest = state.matrix(prefix + "rest", 6, 1);
  places_.clear();
  for (Eigen::Index k = 0; k < places.cols(); ++k) places_.push_back(places.col(k));
  weights_ = Eigen::Map<const Eigen::VectorXd>(weights.data(), places.cols());
  mean_ = mean;
  covariance_ = covariance;
  moved_noise_ = moved_noise;
  yaw_ = rest(0);
  yaw_variance_ = rest(1);
  yaw_covariance_ << rest(2), rest(3);
  moved_ = rest(4) > 0.0;
  left_out_ = rest(5);
}

}  // namespace gmrf_slap
