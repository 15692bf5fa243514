// Localization on a known map: the nodes stay what they are.
#pragma once

#include <memory>

#include "vector_field_slam/solver.hpp"

namespace vector_field_slam {

using AnySensor = SensorModel<double, kMostChannels>;
/// The roles of up to kMostChannels channels, whatever their number.
AnySensor any_sensor(const std::vector<ChannelModel>& channels);

/// Extended Kalman filter over (x, y, yaw, c_x, c_y) only. What is not known of the nodes enters as
/// noise of the measurement, anew in each (their errors are in truth the same each time: the
/// covariance is then a little too small). O(1) per step.
class LocalizeSolver final : public Solver {
 public:
  /// @param map a solver of the kind that made the map; it is restored, asked, and never updated
  LocalizeSolver(std::unique_ptr<Solver> map, const std::vector<ChannelModel>& channels,
                 const GridGeometry<double>& grid, double gate);

  void start(const StartState& state) override;
  void move(const OdometryStep<double>& step, double calibration_variance) override;
  field_core::UpdateResult observe(const Mounting<double>& mounting,
                                   const Observation<double>* observations, int count) override;
  void set_pose(const field_core::SE2& pose, const Eigen::Matrix3d& covariance) override;
  void start_channel(int, double) override {}

  RobotVector robot() const override { return mean_; }
  RobotMatrix robot_covariance() const override { return covariance_; }
  int node_count() const override { return map_->node_count(); }
  GridIndex node_index(int node) const override { return map_->node_index(node); }
  int find(GridIndex index) const override { return map_->find(index); }
  const double* node_values(int node) const override { return map_->node_values(node); }
  Eigen::MatrixXd node_covariance(const std::vector<int>& nodes) const override {
    return map_->node_covariance(nodes);
  }

  void save(field_core::State& state) const override;
  /// A state of this solver, or of the one that made the map.
  void restore(const field_core::State& state) override;

 private:
  bool enter(GridIndex cell);

  std::unique_ptr<Solver> map_;
  AnySensor sensor_;
  int channels_;
  GridGeometry<double> grid_;
  double gate_;
  RobotVector mean_ = RobotVector::Zero();
  RobotMatrix covariance_ = RobotMatrix::Identity();
  // Of the cell of the last measurement.
  GridIndex cell_;
  std::vector<int> nodes_;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 4 * kMostChannels, 4 * kMostChannels>
      node_covariance_;
};

}  // namespace vector_field_slam
