// Parameters that every estimator of the suite has under the same names: how odometry errs, where
// the robot starts, which measurements are used. An estimator's parameters derive from them.
#pragma once

#include <Eigen/Core>

#include "field_core/odometry_motion_model.hpp"
#include "field_core/params.hpp"
#include "field_core/se2.hpp"

namespace field_core {

/// amcl's names, units and meaning.
struct MotionParams {
  OdometryNoise odometry_noise;
  double initial_pose_x = 0.0, initial_pose_y = 0.0, initial_pose_a = 0.0;
  double initial_cov_xx = 0.25, initial_cov_yy = 0.25, initial_cov_aa = 0.0685;
  double update_min_d = 0.0, update_min_a = 0.0;

  SE2 initial_pose() const { return {initial_pose_x, initial_pose_y, initial_pose_a}; }
  /// Of (x, y, yaw); zero where the start is exactly known.
  Eigen::Matrix3d initial_covariance() const {
    return Eigen::Vector3d(initial_cov_xx, initial_cov_yy, initial_cov_aa).asDiagonal();
  }

 protected:
  template <class Visitor>
  void visit_odometry_noise(Visitor& v) {
    v.number("odom_alpha1", odometry_noise.alpha1, non_negative(), "1",
             "rotation noise from rotation, as in amcl");
    v.number("odom_alpha2", odometry_noise.alpha2, non_negative(), "rad^2/m^2",
             "rotation noise from translation");
    v.number("odom_alpha3", odometry_noise.alpha3, non_negative(), "1",
             "translation noise from translation");
    v.number("odom_alpha4", odometry_noise.alpha4, non_negative(), "m^2/rad^2",
             "translation noise from rotation");
  }

  template <class Visitor>
  void visit_start_and_updates(Visitor& v) {
    v.number("initial_pose_x", initial_pose_x, any_number(), "m", "start in the map frame");
    v.number("initial_pose_y", initial_pose_y, any_number(), "m", "start in the map frame");
    v.number("initial_pose_a", initial_pose_a, any_number(), "rad", "start yaw in the map frame");
    v.number("initial_cov_xx", initial_cov_xx, non_negative(), "m^2",
             "variance of the start; 0: exactly known");
    v.number("initial_cov_yy", initial_cov_yy, non_negative(), "m^2", "variance of the start");
    v.number("initial_cov_aa", initial_cov_aa, non_negative(), "rad^2",
             "variance of the start yaw");
    v.number("update_min_d", update_min_d, non_negative(), "m",
             "a measurement is used once the robot has moved this far; 0: every measurement");
    v.number("update_min_a", update_min_a, non_negative(), "rad", "... or turned this much");
  }
};

}  // namespace field_core
