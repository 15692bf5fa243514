// Writes down a run as a BatchProblem, from the calls that a solver gets.
#pragma once

#include "field_core/odometry_motion_model.hpp"
#include "vector_field_slam/batch_problem.hpp"

namespace vector_field_slam {

/// Consecutive motions become one link; a pose is kept for each sample. New poses start where
/// odometry leads from the pose before, new nodes where the online solver has them.
template <int M>
class BatchLog {
 public:
  explicit BatchLog(const Model<M>& model) : model_(model) {}

  void start(const StartState& state);
  /// @param pose of the robot before the motion: the noise is given in the map frame
  void move(const Eigen::Vector3d& pose, const OdometryStep<double>& step);
  void set_pose(const field_core::SE2& pose, const Eigen::Matrix3d& covariance);
  /// A sample that the online solver used, with what it made of it: its pose, and its new nodes.
  void observe(const Mounting<double>& mounting, const Observation<double>* observations, int count,
               const Solver& after);

  /// Complete: a log goes on after a restore as if nothing had been. restore @throws
  /// field_core::DataError and changes nothing then.
  void save(field_core::State& state) const;
  void restore(const field_core::State& state);

  const BatchProblem<M>& problem() const { return problem_; }
  BatchProblem<M>& problem() { return problem_; }

 private:
  void add_nodes(const Solver& solver);

  Model<M> model_;
  BatchProblem<M> problem_;
  PoseLink next_;  // since the last pose; its covariance is not yet turned into a square root
  Eigen::Matrix3d covariance_ = Eigen::Matrix3d::Zero();
};

}  // namespace vector_field_slam
