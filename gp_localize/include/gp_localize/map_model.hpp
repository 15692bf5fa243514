// What the filter needs of a map that is learned while localizing: one interface, one
// implementation per answer to the question "which paths were the measurements taken on?".
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "field_core/estimator.hpp"
#include "field_core/odometry_motion_model.hpp"
#include "field_core/random.hpp"
#include "field_core/state.hpp"
#include "gp_localize/field_model.hpp"
#include "gp_localize/odometry_calibration.hpp"

namespace gp_localize {

/// What one particle believes; also where a sample path stands.
struct RobotState {
  field_core::SE2 pose;
  OdometryCalibration calibration;
};

/// The numbers of a robot state, for state files.
constexpr int kStateSize = 6;
Eigen::Matrix<double, kStateSize, 1> pack(const RobotState& state);
RobotState unpack(const Eigen::Matrix<double, kStateSize, 1>& numbers);

struct Particle : RobotState {
  double weight = 1.0;
};

/// The filter's particles; weights sum to 1.
using ParticleSet = std::vector<Particle>;

/// How robot states start and move: the odometry's noise and its systematic errors.
struct MotionModel {
  field_core::OdometryMotionModel odometry;
  OdometryCalibrationModel calibration;

  RobotState draw(const field_core::SE2& mean, const Eigen::Matrix3d& covariance,
                  field_core::Random& random) const;
  void move(const field_core::OdometryMotion& reported, RobotState& state,
            field_core::Random& random) const;
};

/// Predictive moments of each observation of a step over particles and hypotheses, before the
/// update.
struct Innovation {
  std::vector<double> mean;
  std::vector<double> variance;  ///< with the likelihood's noise
};

/// How much a field varies over the area, and one measurement of it at the same place.
struct FieldVariances {
  double signal, noise;
};

class MapModel {
 public:
  virtual ~MapModel() = default;

  /// Forgets everything; hypotheses start at states drawn around N(pose, covariance).
  virtual void restart(const field_core::SE2& pose, const Eigen::Matrix3d& covariance,
                       const MotionModel& model, field_core::Random& random) = 0;
  /// The robot was moved or its pose given anew; the map is kept.
  virtual void relocate(const ParticleSet& particles, field_core::Random& random) = 0;
  /// The robot drove `motion`.
  virtual void move(const field_core::OdometryMotion& motion, const MotionModel& model,
                    field_core::Random& random) = 0;
  /// log p(observations | particle) for each particle into `log_likelihood` (resized).
  virtual void weigh(const ParticleSet& particles, const field_core::SE2& sensor_in_base,
                     const std::vector<Observation>& observations,
                     std::vector<double>& log_likelihood, Innovation& innovation) = 0;
  /// The observations just weighed were used: learns from them what is not the map (drift of the
  /// fields, factors of their variances).
  virtual void accept(const std::vector<Observation>&) {}
  /// Of the fields just weighed, the share of their variance that the map known before the run
  /// leaves open at the most probable pose; 1 without such a map.
  virtual double unknown(const ParticleSet&, const std::vector<Observation>&) const { return 1.0; }
  /// From now on the map that most particles have is what was known before the run.
  virtual void keep_as_known() {}
  /// Adds the observations just weighed. `particles` carry their new weights, not resampled yet.
  virtual void learn(const ParticleSet& particles, const field_core::SE2& sensor_in_base,
                     const std::vector<Observation>& observations, field_core::Random& random) = 0;
  /// Particle i is now a copy of what ancestors[i] was; not decreasing, and their number is the
  /// number of particles from now on.
  virtual void resampled(const std::vector<int>& ancestors) = 0;
  /// Of field f, as the particles believe.
  virtual FieldVariances variances(int field, const ParticleSet& particles) const = 0;
  /// Mean and variance (noise not included) of field f, minus its prior mean, at points (2 x n).
  virtual void predict(int field, const Eigen::Matrix2Xd& points, const ParticleSet& particles,
                       Eigen::VectorXd& mean, Eigen::VectorXd& variance) const = 0;

  /// Support points that were added during the run, 2 x n.
  virtual Eigen::Matrix2Xd grown_support() const { return Eigen::Matrix2Xd(2, 0); }
  /// What the particles believe of the hyperparameters, where they are learned; empty otherwise.
  virtual std::vector<field_core::HyperparameterPosterior> hyperparameters(
      const ParticleSet&) const {
    return {};
  }

  virtual void save(field_core::State& state) const = 0;
  /// Particle i becomes what ancestors[i] was when the state was saved.
  /// @throws DataError and changes nothing
  virtual void restore(const field_core::State& state, const std::vector<int>& ancestors) = 0;
};

/// @throws ParameterError for a combination of parameters that no model offers
std::unique_ptr<MapModel> make_map_model(const GpLocalizeParams& params,
                                         const std::vector<FieldModel>& fields);

}  // namespace gp_localize
