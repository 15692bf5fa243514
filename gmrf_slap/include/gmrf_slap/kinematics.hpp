// Commands as motions: the paper's section II.C and its two-wheel robot, eq. (19)-(27).
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "field_core/se2.hpp"

namespace gmrf_slap {

/// F u of eq. (6): displacement in the map frame at speed u [m/s] along a known heading [rad], for
/// Slap::displace.
inline Eigen::Vector2d command_displacement(double speed, double heading, double duration) {
  return speed * duration * Eigen::Vector2d(std::cos(heading), std::sin(heading));
}

/// Motion of a robot whose wheels, `wheel_distance` [m] apart, turn at these speeds [m/s] for
/// `duration` [s], in its own frame, for Slap::predict: an exact arc, of which eq. (24)-(25) are
/// the first order. The print of eq. (26) has the turn the other way round; with x forward and yaw
/// counter-clockwise the robot turns left when the right wheel is faster.
inline field_core::SE2 two_wheel_motion(double left, double right, double wheel_distance,
                                        double duration) {
  const double v = 0.5 * (left + right), omega = (right - left) / wheel_distance;
  return field_core::SE2::exp({v * duration, 0.0, omega * duration});
}

}  // namespace gmrf_slap
