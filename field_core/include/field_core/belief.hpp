// What an estimator believes about the robot's pose.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "field_core/se2.hpp"
#include "field_core/stamp.hpp"

namespace field_core {

struct WeightedPose {
  SE2 pose;
  double weight = 1.0;
};

/// Pose of the robot's base in the map frame.
struct Belief {
  Stamp stamp{0};
  SE2 mean;
  /// Covariance of (x [m], y [m], yaw [rad]) in the map frame; symmetric positive definite.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
  /// Particles or candidates, weights summing to 1; empty if the estimator has none.
  std::vector<WeightedPose> particles;
};

/// Smallest variance that a belief reports, (1 micrometre)^2 and (1 microradian)^2: an exactly
/// known pose stays positive definite.
constexpr double kMinimumPoseVariance = 1e-12;

/// Weighted mean (circular for yaw) and covariance of the particles, with kMinimumPoseVariance
/// added to the diagonal. Weights need not be normalized. Complexity O(particles).
/// @throws NumericalError if there is no particle or the weights do not sum to a positive number
void summarize_particles(const std::vector<WeightedPose>& particles, SE2& mean,
                         Eigen::Matrix3d& covariance);

}  // namespace field_core
