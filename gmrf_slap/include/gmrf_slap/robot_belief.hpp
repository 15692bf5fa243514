// What is believed of one robot's pose, and how a measurement changes it together with the fields.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "field_core/estimator.hpp"
#include "gmrf_slap/field_bank.hpp"

namespace gmrf_slap {

class RobotBelief {
 public:
  virtual ~RobotBelief() = default;

  /// Motion that odometry reports, with the odometry motion model's noise.
  virtual void predict(const field_core::SE2& delta) = 0;
  /// Eq. (6): the position moves by F u + w in the map frame, w ~ N(0, noise); yaw is known.
  virtual void displace(const Eigen::Vector2d& motion, const Eigen::Matrix2d& noise) = 0;
  /// Eq. (3): an observation of the position with this covariance.
  virtual field_core::UpdateResult observe_position(const FieldBank& fields,
                                                    const Eigen::Vector2d& position,
                                                    const Eigen::Matrix2d& covariance) = 0;
  /// Eq. (8)-(17). The observations are of distinct fields.
  virtual field_core::UpdateResult update(FieldBank& fields,
                                          const std::vector<Observation>& observations,
                                          const field_core::SE2& sensor_in_base) = 0;
  /// Its stamp is not set.
  virtual field_core::Belief belief() const = 0;
  /// Brings what only this belief knows of the fields into them, by moment matching.
  virtual void merge_into(FieldBank& fields) const = 0;
  /// Mean of a field at all sites, a deviation from the prior mean, with what only this belief
  /// knows: the exact mixture over its hypotheses.
  virtual Eigen::VectorXd field_mean(const FieldMixture& field, std::size_t index) const = 0;
  /// pi(theta | D) of a field with what only this belief knows.
  virtual Eigen::VectorXd theta_posterior(const FieldMixture& field, std::size_t index) const = 0;
  /// Share of the posterior mass that the last update left out.
  virtual double left_out_mass() const = 0;
  /// Share of the information in the last measurement that groups of candidates left out of the
  /// covariances (PlaceGroups), the most of any field and theta.
  virtual double left_out_information() const { return 0.0; }

  virtual void set_pose(const field_core::SE2& mean, const Eigen::Matrix3d& covariance) = 0;
  /// Anywhere on the grid, any yaw.
  virtual void scatter(const FieldBank& fields) = 0;
  /// Complete, given the fields. restore @throws DataError and changes nothing then.
  virtual void save(field_core::State& state, const std::string& prefix) const = 0;
  virtual void restore(const field_core::State& state, const std::string& prefix,
                       const FieldBank& fields) = 0;
};

}  // namespace gmrf_slap
