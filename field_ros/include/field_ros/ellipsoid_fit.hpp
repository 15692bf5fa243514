// Hard and soft iron of a magnetometer: readings of a constant field, in all attitudes, lie on an
// ellipsoid; calibrated they lie on a sphere about the origin.
#pragma once

#include <Eigen/Core>

namespace field_ros {

/// calibrated = matrix * (raw - offset)
struct MagnetometerCalibration {
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();      ///< hard iron, in the unit of the readings
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();  ///< soft iron, symmetric
  double field = 0.0;                                    ///< magnitude of the calibrated readings
  double residual = 0.0;                                 ///< RMS of |calibrated| - field
  double raw_residual = 0.0;                             ///< RMS of |raw| about its mean

  Eigen::Vector3d operator()(const Eigen::Vector3d& raw) const { return matrix * (raw - offset); }
};

/// Least-squares quadric x'Ax + b'x = 1 through the readings (algebraic distance, after shifting
/// and scaling them to their mean and spread); `matrix` is the symmetric square root of A, scaled
/// so that its determinant is 1: the mean magnitude is kept. O(n).
/// @param readings 3 x n
/// @throws NumericalError saying what to do if they do not determine an ellipsoid: fewer than 9, or
/// not turned about enough axes
MagnetometerCalibration fit_ellipsoid(const Eigen::Matrix3Xd& readings);

/// A robot on a floor turns about z only, whose readings are a plane ellipse: offset and soft iron
/// in x and y, z is left as it is. The same @throws with 5 readings.
MagnetometerCalibration fit_ellipse(const Eigen::Matrix3Xd& readings);

}  // namespace field_ros
