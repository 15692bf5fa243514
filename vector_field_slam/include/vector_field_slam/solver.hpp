// What every solver offers the estimator, whatever keeps its state: EKF, ESEIF or batch.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "field_core/estimator.hpp"
#include "field_core/state.hpp"
#include "vector_field_slam/model.hpp"

namespace vector_field_slam {

using RobotVector = Eigen::Matrix<double, kRobot, 1>;
using RobotMatrix = Eigen::Matrix<double, kRobot, kRobot>;

/// Eq. (12)-(13): where a solver starts.
struct StartState {
  RobotVector robot;            ///< x, y, yaw, c_x, c_y
  RobotMatrix covariance;       ///< symmetric positive definite
  GridIndex cell;               ///< the cell of the sensor
  Eigen::MatrixXd node_values;  ///< channels x 4, in cell_node order
};

/// One thread at a time. A node's number is its place in the order of creation and never changes.
class Solver {
 public:
  virtual ~Solver() = default;

  virtual void start(const StartState& state) = 0;
  /// Motion of the robot, eq. (19)-(29) or their covariance form; calibration_variance is added to
  /// that of each component of the offset c.
  virtual void move(const OdometryStep<double>& step, double calibration_variance) = 0;
  /// Time of the sample that follows: for solvers that keep the whole run.
  virtual void stamp(field_core::Stamp) {}
  /// One sample: enters the sensor's cell, adding nodes as needed, and updates by the readings.
  /// @param observations `count` of them, distinct channels
  virtual field_core::UpdateResult observe(const Mounting<double>& mounting,
                                           const Observation<double>* observations, int count) = 0;
  /// The pose is set from outside (/initialpose): independent of the map from now on.
  virtual void set_pose(const field_core::SE2& pose, const Eigen::Matrix3d& covariance) = 0;

  /// A channel is seen for the first time, after the start: all nodes take this value (node unit)
  /// for it, with the spread they have. O(nodes), once per channel.
  virtual void start_channel(int channel, double value) = 0;

  virtual RobotVector robot() const = 0;
  virtual RobotMatrix robot_covariance() const = 0;

  virtual int node_count() const = 0;
  virtual GridIndex node_index(int node) const = 0;
  virtual int find(GridIndex index) const = 0;            ///< node number, -1: no such node
  virtual const double* node_values(int node) const = 0;  ///< one per channel, node unit
  /// Joint covariance of the values of some nodes, (channels n) x (channels n); exact for the EKF,
  /// for the ESEIF conditional on what lies outside their surroundings (eq. 44).
  virtual Eigen::MatrixXd node_covariance(const std::vector<int>& nodes) const = 0;

  /// Whether a background optimization that is due is waited for (replays) or not (live).
  virtual void wait_for_background(bool) {}

  /// Complete: what follows a restore is bit for bit the same. restore @throws
  /// field_core::DataError and changes nothing then.
  virtual void save(field_core::State& state) const = 0;
  virtual void restore(const field_core::State& state) = 0;
};

}  // namespace vector_field_slam
