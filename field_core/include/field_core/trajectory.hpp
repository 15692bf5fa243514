// A trajectory: poses ordered by stamp, with covariances where the source has them.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "field_core/csv.hpp"
#include "field_core/se2.hpp"
#include "field_core/stamp.hpp"

namespace field_core {

struct StampedPose {
  Stamp stamp{0};
  SE2 pose;
  std::optional<Eigen::Matrix3d> covariance;  ///< of (x, y, yaw)
};

using Trajectory = std::vector<StampedPose>;

/// Reads `.tum` (stamp tx ty tz qx qy qz qw, '#' comments) or `.csv` (header with at least
/// stamp_s,x_m,y_m,yaw_rad; with cov_xx,cov_xy,cov_xa,cov_yy,cov_ya,cov_aa if covariances are
/// there).
/// @throws DataError naming file and line: unreadable, missing column, not a number, not finite,
/// stamps
///         not strictly increasing, empty
Trajectory read_trajectory(const std::string& path);

/// The same from a table in memory. @throws DataError as above
Trajectory trajectory_from_csv(const CsvTable& table);

/// The poses with from <= stamp <= to; empty if there are none.
Trajectory between_stamps(const Trajectory& trajectory, Stamp from, Stamp to);

/// The pose at a stamp, interpolated; nullopt outside the trajectory. O(log n).
std::optional<SE2> pose_at(const Trajectory& trajectory, Stamp stamp);

/// Lines of the two formats, for writers; without the line end.
std::string tum_line(Stamp stamp, const SE2& pose);
extern const char* const kEstimateCsvHeader;  ///< stamp_s,x_m,y_m,yaw_rad,cov_xx,...,cov_aa
std::string estimate_csv_line(Stamp stamp, const SE2& pose, const Eigen::Matrix3d& covariance);

}  // namespace field_core
