#include "gmrf_slap/slap.hpp"

#include <Eigen/LU>
#include <cmath>

#include "field_core/errors.hpp"
#include "lattice_belief.hpp"
#include "trajectory_belief.hpp"

namespace gmrf_slap {

using field_core::SE2;
using field_core::UpdateResult;

Slap::Slap(const GmrfSlapParams& params, std::uint64_t seed, const Walls& walls)
    : params_(params), seed_(seed), fields_(params, walls) {
  for (const FieldMixture& field : fields_.fields()) infos_.push_back(field.info);
  for (const std::string& robot : params.robots) {
    senses_.push_back({params.of_robot(robot), {}});
    for (const auto& entry : senses_.back().params.fields) {
      const double stddev = senses_.back().params.measurement_stddev_of(entry.second);
      senses_.back().noise_variance.push_back(stddev * stddev);
    }
  }
  robots_.resize(params.robots.size());
  reset();
}

std::unique_ptr<RobotBelief> Slap::make_belief(int robot) const {
  // Robots draw different numbers.
  const std::uint64_t seed = seed_ + 0x9E3779B97F4A7C15ull * static_cast<std::uint64_t>(robot);
  const GmrfSlapParams& params = senses(robot).params;
  std::unique_ptr<RobotBelief> belief;
  if (params.position_belief == PositionBelief::trajectories) {
    belief = std::make_unique<TrajectoryBelief>(params, fields_, seed);
  } else {
    belief = std::make_unique<LatticeBelief>(params, fields_);
  }
  belief->set_pose(params.initial_pose(), params.initial_covariance());
  return belief;
}

void Slap::reset() {
  fields_.reset();
  merged_.reset();
  for (int r = 0; r < robots(); ++r) {
    at(r) = Robot{};
    at(r).belief = make_belief(r);
  }
}

void Slap::predict(int robot, const field_core::OdometryIncrement& increment) {
  Robot& r = at(robot);
  r.belief->predict(increment.delta);
  r.stamp = increment.to;
  r.moved_distance += increment.delta.translation().norm();
  r.moved_angle += std::abs(increment.delta.yaw());
}

void Slap::displace(int robot, const Eigen::Vector2d& motion, const Eigen::Matrix2d& noise) {
  at(robot).belief->displace(motion, noise);
  at(robot).moved_distance += motion.norm();
}

UpdateResult Slap::observe_position(int robot, const Eigen::Vector2d& position,
                                    const Eigen::Matrix2d& covariance) {
  Robot& r = at(robot);
  const double stddev = senses(robot).params.position_stddev, variance = stddev * stddev;
  const Eigen::Matrix2d noise =
      covariance.isZero(0.0) ? Eigen::Matrix2d(variance * Eigen::Matrix2d::Identity()) : covariance;
  const field_core::Belief belief = r.belief->belief();
  const Eigen::Vector2d innovation = position - belief.mean.translation();
  const Eigen::Matrix2d spread = belief.covariance.topLeftCorner<2, 2>() + noise;
  const double squared = innovation.dot(spread.inverse() * innovation);
  if (!(squared <= kImplausibleSigmas * kImplausibleSigmas)) {
    return UpdateResult::skipped("position observation off the belief");
  }
  merged_.reset();
  return r.belief->observe_position(fields_, position, noise);
}

UpdateResult Slap::update(int robot, const field_core::Sample& sample) {
  Robot& r = at(robot);
  if (r.updated && r.moved_distance < params_.update_min_d &&
      r.moved_angle < params_.update_min_a) {
    return UpdateResult::skipped("not moved enough");
  }
  observations_.clear();
  for (const field_core::Reading& reading : sample.readings) {
    if (reading.field < 0 || reading.field >= static_cast<int>(infos_.size())) continue;
    const FieldMixture& field = fields_.fields()[static_cast<std::size_t>(reading.field)];
    const double noise =
        reading.variance > 0.0
            ? reading.variance
            : senses(robot).noise_variance[static_cast<std::size_t>(reading.field)];
    observations_.push_back({reading.field, reading.value, noise + field.nugget_variance});
  }
  if (observations_.empty()) return UpdateResult::skipped("no known field");
  merged_.reset();
  const UpdateResult result = r.belief->update(fields_, observations_, sample.sensor_in_base);
  r.stamp = sample.stamp;
  if (result.applied) {
    r.updated = true;
    r.moved_distance = r.moved_angle = 0.0;
  }
  return result;
}

field_core::Belief Slap::belief(int robot) const {
  field_core::Belief belief = at(robot).belief->belief();
  belief.stamp = at(robot).stamp;
  return belief;
}

const FieldBank& Slap::merged() const {
  if (!merged_) {
    merged_ = std::make_unique<FieldBank>(fields_);
    for (const Robot& robot : robots_) robot.belief->merge_into(*merged_);
  }
  return *merged_;
}

Eigen::VectorXd Slap::site_mean(int field) const {
  const auto f = static_cast<std::size_t>(field);
  // One robot: the exact mixture over its trajectories. Several: they would count common knowledge
  // twice, so their moment-matched fields are joined.
  if (robots() > 1) return merged().fields().at(f).site_mean();
  return robots_[0].belief->field_mean(fields_.fields().at(f), f);
}

field_core::FieldPrediction Slap::predict_field(const Eigen::Matrix2Xd& points) const {
  field_core::FieldPrediction out = merged().predict(points);
  if (robots() > 1) return out;
  for (std::size_t f = 0; f < infos_.size(); ++f) {
    const FieldMixture& field = fields_.fields()[f];
    const Eigen::VectorXd mean = site_mean(static_cast<int>(f));
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      out.mean(static_cast<Eigen::Index>(f), i) =
          field.prior_mean(points.col(i)) + fields_.row(points.col(i)).dot(mean);
    }
  }
  return out;
}

std::vector<field_core::HyperparameterPosterior> Slap::hyperparameters() const {
  std::vector<field_core::HyperparameterPosterior> out;
  for (std::size_t f = 0; f < infos_.size(); ++f) {
    const FieldMixture& field = fields_.fields()[f];
    Eigen::MatrixXd values(3, field.hypotheses());
    for (int l = 0; l < field.hypotheses(); ++l) {
      const Theta& theta = field.thetas[static_cast<std::size_t>(l)];
      values.col(l) << theta.kappa, theta.alpha, theta.order;
    }
    out.push_back({field.info.name, {"kappa", "alpha", "order"}, values, theta_posterior(f)});
  }
  return out;
}

Eigen::VectorXd Slap::theta_posterior(std::size_t f) const {
  if (robots() > 1) return merged().fields()[f].probability;
  return robots_[0].belief->theta_posterior(fields_.fields()[f], f);
}

field_core::MapRegion Slap::map_region() const {
  const Lattice& lattice = fields_.lattice();
  const Eigen::Vector2d half = Eigen::Vector2d::Constant(0.5 * lattice.spacing());
  const Eigen::Vector2d low = lattice.position(0) - half;
  const Eigen::Vector2d high = lattice.position(lattice.sites() - 1) + half;
  return {low.x(), low.y(), high.x(), high.y()};
}

void Slap::set_pose(int robot, const SE2& mean, const Eigen::Matrix3d& covariance) {
  at(robot).belief->set_pose(mean, covariance);
  at(robot).updated = false;
}

void Slap::scatter(int robot) {
  at(robot).belief->scatter(fields_);
  at(robot).updated = false;
}

void Slap::save(field_core::State& state) const {
  fields_.save(state);
  for (std::size_t r = 0; r < robots_.size(); ++r) {
    const std::string prefix = "robot" + std::to_string(r) + "/";
    robots_[r].belief->save(state, prefix);
    const Eigen::Vector3d moved(robots_[r].updated, robots_[r].moved_distance,
                                robots_[r].moved_angle);
    state.set(prefix + "moved", moved);
    state.set_text(prefix + "stamp", field_core::format_stamp(robots_[r].stamp));
  }
}

void Slap::restore(const field_core::State& state) {
  FieldBank fields(fields_);
  fields.restore(state);
  std::vector<Robot> robots;
  for (int r = 0; r < this->robots(); ++r) {
    const std::string prefix = "robot" + std::to_string(r) + "/";
    Robot robot;
    robot.belief = make_belief(r);
    robot.belief->restore(state, prefix, fields);
    const Eigen::MatrixXd& moved = state.matrix(prefix + "moved", 3, 1);
    robot.updated = moved(0) > 0.0;
    robot.moved_distance = moved(1);
    robot.moved_angle = moved(2);
    robot.stamp = field_core::parse_stamp(state.text(prefix + "stamp"));
    robots.push_back(std::move(robot));
  }
  fields_ = std::move(fields);
  robots_ = std::move(robots);
  merged_.reset();
}

}  // namespace gmrf_slap
