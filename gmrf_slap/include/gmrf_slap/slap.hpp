// Simultaneous localization and spatial prediction for N robots that share their fields (Jadaliha
// and Choi: fully Bayesian SLAP with Gaussian Markov random fields, eq. 7-17).
//
// Each robot has its own belief of its pose; the fields, under every hyperparameter vector, are
// common. Robots measure and move at any rate and in any order: one that falls silent costs
// nothing. Given the fields, the robots' positions are taken as independent (the paper's Gaussian
// of eq. 7 has their covariance; what ties them together beyond the fields is not modelled).
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "field_core/estimator.hpp"
#include "gmrf_slap/field_bank.hpp"
#include "gmrf_slap/params.hpp"
#include "gmrf_slap/robot_belief.hpp"

namespace gmrf_slap {

class Slap {
 public:
  /// @throws ParameterError as FieldBank does
  Slap(const GmrfSlapParams& params, std::uint64_t seed, const Walls& walls = {});

  /// Everything starts again with fields that have no correlation through these.
  void set_walls(const Walls& walls) { *this = Slap(params_, seed_, walls); }

  int robots() const { return static_cast<int>(robots_.size()); }
  void predict(int robot, const field_core::OdometryIncrement& increment);
  /// Eq. (6) with a known command F u and noise covariance of w, in the map frame.
  void displace(int robot, const Eigen::Vector2d& motion, const Eigen::Matrix2d& noise);
  /// Eq. (3). A covariance of 0 stands for the robot's position_stddev. Skips: "position
  /// observation off the belief": more than kImplausibleSigmas standard deviations away.
  field_core::UpdateResult observe_position(
      int robot, const Eigen::Vector2d& position,
      const Eigen::Matrix2d& covariance = Eigen::Matrix2d::Zero());
  /// Skips: "no known field", "not moved enough", "outside the grid".
  field_core::UpdateResult update(int robot, const field_core::Sample& sample);

  field_core::Belief belief(int robot) const;
  /// Share of the posterior mass of the robot's position that its last update left out.
  double left_out_mass(int robot) const { return at(robot).belief->left_out_mass(); }
  double left_out_information(int robot) const { return at(robot).belief->left_out_information(); }
  /// Mean of a field at all sites, a deviation from its prior mean.
  Eigen::VectorXd site_mean(int field) const;
  const FieldBank& bank() const { return fields_; }
  /// With all that the robots know.
  field_core::FieldPrediction predict_field(const Eigen::Matrix2Xd& points) const;
  /// pi(theta | D) of each field: kappa, alpha (lattice units) and order of each vector.
  std::vector<field_core::HyperparameterPosterior> hyperparameters() const;
  const std::vector<field_core::FieldInfo>& fields() const { return infos_; }
  field_core::MapRegion map_region() const;

  void set_pose(int robot, const field_core::SE2& mean, const Eigen::Matrix3d& covariance);
  void scatter(int robot);
  void reset();

  void save(field_core::State& state) const;
  /// @throws DataError and changes nothing if the state does not fit
  void restore(const field_core::State& state);

 private:
  /// How one robot senses; robots differ in it (robot_models).
  struct Senses {
    GmrfSlapParams params;
    std::vector<double> noise_variance;  // of each field
  };
  struct Robot {
    std::unique_ptr<RobotBelief> belief;
    field_core::Stamp stamp{0};
    bool updated = false;  // the first measurement is used wherever the robot stands
    double moved_distance = 0.0, moved_angle = 0.0;  // since the last update
  };
  Robot& at(int robot) { return robots_.at(static_cast<std::size_t>(robot)); }
  const Senses& senses(int robot) const { return senses_.at(static_cast<std::size_t>(robot)); }
  const Robot& at(int robot) const { return robots_.at(static_cast<std::size_t>(robot)); }
  std::unique_ptr<RobotBelief> make_belief(int robot) const;
  const FieldBank& merged() const;
  Eigen::VectorXd theta_posterior(std::size_t field) const;

  GmrfSlapParams params_;
  std::vector<Senses> senses_;
  std::uint64_t seed_;
  FieldBank fields_;
  std::vector<field_core::FieldInfo> infos_;
  std::vector<Robot> robots_;
  std::vector<Observation> observations_;  // kept between steps
  // Fields with what only the robots know, made when asked for.
  mutable std::unique_ptr<FieldBank> merged_;
};

/// A position observation this far off the belief is a fault of the sensor, not news.
constexpr double kImplausibleSigmas = 10.0;

}  // namespace gmrf_slap
