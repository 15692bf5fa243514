// The first measurements, until there are enough for the field around the start: eq. (11)-(13).
#pragma once

#include <vector>

#include "vector_field_slam/solver.hpp"

namespace vector_field_slam {

/// Dead reckoning from the initial pose, and the field samples seen on the way.
class Start {
 public:
  Start(const VectorFieldSlamParams& params, const std::vector<ChannelModel>& channels,
        const GridGeometry<double>& grid);

  void move(const OdometryStep<double>& step);
  void set_pose(const field_core::SE2& pose, const Eigen::Matrix3d& covariance);
  /// Keeps the field values of a sample. @return true once there are enough
  bool add(const Mounting<double>& mounting, const Observation<double>* observations, int count);
  /// Eq. (12)-(13) at the pose of now; a channel that was not seen starts at 0.
  /// @param cell of the sensor
  StartState state(GridIndex cell) const;
  /// Which channels were seen.
  std::vector<bool> seen() const;

  const field_core::SE2& pose() const { return pose_; }
  const Eigen::Matrix3d& covariance() const { return covariance_; }

  void save(field_core::State& state) const;
  void restore(const field_core::State& state);  ///< @throws field_core::DataError

 private:
  RobotVector robot() const;

  std::vector<ChannelModel> channels_;
  GridGeometry<double> grid_;
  int wanted_;
  double calibration_variance_;
  field_core::SE2 pose_;
  Eigen::Matrix3d covariance_;
  int measurements_ = 0;
  std::vector<std::vector<FieldSample<double>>> samples_;  ///< by channel
};

}  // namespace vector_field_slam
