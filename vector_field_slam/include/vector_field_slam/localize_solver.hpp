// Localization on a known map: the nodes stay what they are.
#pragma once

#include <memory>

#include "vector_field_slam/solver.hpp"

namespace vector_field_slam {

using AnySensor = SensorModel<double, kMostChannels>;
/// The roles of up to kMostChannels channels, whatever their number.
AnySensor any_sensor(const std::vector<ChannelModel>& channels);

/// Extended Kalman filter over (x, y, yaw, c_x, c_y) only; the nodes' errors are considered, not
/// estimated (Schmidt 1966): a node errs in the same way each time, so the covariance of the
/// robot's error with those of its cell's nodes is kept, and no number of readings makes the pose
/// better known than the map. From cell to cell it is carried over by the map's own covariance, the
/// robot being independent of the new nodes given the old. O(1) per step, O(channels^3) per cell.
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
  // Of the nodes of a cell: channels within nodes.
  using NodeMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 4 * kMostChannels,
                                   4 * kMostChannels>;
  using CrossMatrix = Eigen::Matrix<double, kRobot, Eigen::Dynamic, 0, kRobot, 4 * kMostChannels>;
  struct Rows;

  bool enter(GridIndex cell);
  /// The covariance with the nodes of the last cell becomes that with `nodes`.
  void carry_over(const std::vector<int>& nodes);
  /// Of those observations that pass the gate.
  Rows linearize(const SensorPose<double>& sensor, const Observation<double>* observations,
                 int count) const;

  std::unique_ptr<Solver> map_;
  AnySensor sensor_;
  int channels_;
  GridGeometry<double> grid_;
  double gate_;
  RobotVector mean_ = RobotVector::Zero();
  RobotMatrix covariance_ = RobotMatrix::Identity();
  // Of the cell of the last measurement; no nodes: there was none.
  GridIndex cell_;
  std::vector<int> nodes_;
  NodeMatrix node_covariance_;
  CrossMatrix cross_;  // of the robot's error with the nodes'
};

}  // namespace vector_field_slam
