// Errors of an estimated trajectory against the truth, and of predictions against values.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "field_core/trajectory.hpp"

namespace field_core {

/// How the estimate is laid over the truth before errors are taken (rigid, no scale):
/// none; first: the first common poses coincide; best: least squares over positions (Umeyama 1991).
enum class Alignment { none, first, best };

struct ErrorStatistics {
  double mean = 0.0, median = 0.0, rmse = 0.0, p95 = 0.0, max = 0.0, final = 0.0;
};

struct TrajectoryErrors {
  std::size_t poses = 0;              ///< estimates with truth at their stamp
  ErrorStatistics position;           ///< absolute trajectory error [m]
  ErrorStatistics yaw;                ///< absolute [rad]
  ErrorStatistics relative_position;  ///< over relative_distance of driven path [m]
  ErrorStatistics relative_yaw;       ///< [rad]
  double relative_distance = 0.0;     ///< [m]
  std::optional<double>
      nees;  ///< mean normalized estimation error squared of (x, y, yaw): 3 is ideal
  std::optional<double> nees_position;            ///< of (x, y): 2 is ideal
  std::optional<double> share_inside_90_ellipse;  ///< of (x, y): 0.9 is ideal
  SE2 alignment;              ///< the motion laid on every estimate: aligned = alignment * pose
  std::vector<Stamp> stamps;  ///< of the compared poses
  std::vector<double> position_errors;  ///< per compared pose [m]
};

/// Compares each estimate with the truth interpolated at its stamp (Sturm et al. 2012 for ATE and
/// RPE; Bar-Shalom, Li, Kirubarajan 2001, section 5.4 for NEES). NEES and share are over the poses
/// that carry a covariance, which is turned with the alignment. Complexity O(n log n).
/// @param relative_distance path length of the relative errors [m], default 1/10 of the path; the
///        relative errors are NaN if the path is shorter, or if the robot stands still
/// @throws DataError if no stamp is common, NumericalError if a covariance is not positive definite
TrajectoryErrors compare(const Trajectory& truth, const Trajectory& estimate, Alignment alignment,
                         double relative_distance = 0.0);

/// Statistics of non-negative numbers in order of time; p95 and median interpolate linearly between
/// the two nearest ranks (numpy's default). All NaN if there are none.
ErrorStatistics error_statistics(const std::vector<double>& errors);

/// Mean negative log predictive density of values under independent Gaussians.
/// @throws NumericalError if sizes differ, there is no value, or a variance is not positive
double negative_log_predictive_density(const Eigen::VectorXd& values, const Eigen::VectorXd& means,
                                       const Eigen::VectorXd& variances);

/// Odometry laid from a start pose: each increment scaled in translation by `translation_scale`.
Trajectory dead_reckoning(const Trajectory& odometry, const SE2& start,
                          double translation_scale = 1.0);

/// Dead reckoning over the part of the odometry that has truth, from the true pose at its first
/// stamp.
/// @throws DataError if no stamp is common
Trajectory dead_reckoning_from_truth(const Trajectory& truth, const Trajectory& odometry,
                                     double translation_scale = 1.0);

/// The constant translation scale in [0.5, 2] that minimizes the mean position error of dead
/// reckoning from the true start: what a perfectly calibrated odometer would do. Golden section to
/// 1e-4: dead-reckoned positions are affine in the scale, so the mean error is convex and has one
/// minimum.
/// @throws DataError if no stamp is common
double best_translation_scale(const Trajectory& truth, const Trajectory& odometry);

}  // namespace field_core
