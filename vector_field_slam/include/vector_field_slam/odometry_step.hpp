// One step of odometry in map coordinates (paper eq. 49), as all solvers take it.
#pragma once

#include <cmath>

namespace vector_field_slam {

/// The robot goes to (x + dx, y + dy, yaw + dyaw), where (dx, dy) is the displacement of this step
/// in the map frame; its error has the covariance R, which may be singular or zero.
template <class S>
struct OdometryStep {
  S dx, dy, dyaw;  ///< [m], [rad]
  S noise[3][3];   ///< R_t, symmetric positive semi-definite

  /// G_x and its inverse, which differ in the sign of the displacement.
  void jacobian(S g[3][3]) const { fill(g, dx, dy); }
  void inverse_jacobian(S g[3][3]) const { fill(g, -dx, -dy); }

 private:
  static void fill(S g[3][3], S dx, S dy) {
    const S values[3][3] = {{S(1), S(0), -dy}, {S(0), S(1), dx}, {S(0), S(0), S(1)}};
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) g[i][j] = values[i][j];
    }
  }
};

}  // namespace vector_field_slam
