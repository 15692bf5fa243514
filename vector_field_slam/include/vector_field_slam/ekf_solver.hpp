// Vector Field SLAM by an extended Kalman filter over the full state (paper section II): the exact
// covariance form of the model, against which the information filter is measured.
#pragma once

#include "vector_field_slam/node_table.hpp"
#include "vector_field_slam/solver.hpp"
#include "vector_field_slam/underweighting.hpp"

namespace vector_field_slam {

/// State (x, y, yaw, c_x, c_y, m_1 .. m_N), eq. (10). A measurement costs O(n^2) for n = 5 + M N
/// variables, a motion O(n), a new node O(n M). Allocates when the map grows, by doubling.
template <int M>
class EkfSolver final : public Solver {
 public:
  /// @param gate largest squared innovation, in its variance, that is believed; 0: any
  /// @param underweighting see underweighting.hpp
  EkfSolver(const Model<M>& model, double gate, int most_nodes, double underweighting = 0.0);

  void start(const StartState& state) override;
  void move(const OdometryStep<double>& step, double calibration_variance) override;
  field_core::UpdateResult observe(const Mounting<double>& mounting,
                                   const Observation<double>* observations, int count) override;
  void set_pose(const field_core::SE2& pose, const Eigen::Matrix3d& covariance) override;

  void start_channel(int channel, double value) override;

  RobotVector robot() const override { return mean_.head<kRobot>(); }
  RobotMatrix robot_covariance() const override {
    return covariance_.topLeftCorner<kRobot, kRobot>();
  }
  int node_count() const override { return table_.size(); }
  GridIndex node_index(int node) const override { return table_.index(node); }
  int find(GridIndex index) const override { return table_.find(index); }
  const double* node_values(int node) const override { return mean_.data() + first(node); }
  Eigen::MatrixXd node_covariance(const std::vector<int>& nodes) const override;

  void save(field_core::State& state) const override;
  void restore(const field_core::State& state) override;

  /// The whole state, for tests.
  Eigen::VectorXd mean() const { return mean_.head(size_); }
  Eigen::MatrixXd covariance() const { return covariance_.topLeftCorner(size_, size_); }

 private:
  using Values = Eigen::Matrix<double, M, 1>;
  using LocalMatrix = Eigen::Matrix<double, kRobot + 4 * M, kRobot + 4 * M>;
  static int first(int node) { return kRobot + M * node; }
  void reserve(int variables);
  /// One more node, independent of all others.
  void append(GridIndex index, const Values& mean, const Values& variance);
  void extrapolate(GridIndex index, ExtrapolationSource source);
  bool enter(GridIndex cell, const Values& unknown_values);
  void find_nodes(GridIndex cell, int* nodes, const double** values) const;
  /// Columns of P H^T for one reading. @param row its row of H over robot and the cell's nodes
  void project(const double* row, const int* nodes, Eigen::Ref<Eigen::VectorXd> column) const;
  /// P over robot and the cell's nodes, in the order of local_row().
  LocalMatrix local_covariance(const int* nodes) const;
  double correlate(const double* row, const int* nodes,
                   const Eigen::Ref<const Eigen::VectorXd>& column) const;

  Model<M> model_;
  double gate_, underweighting_;
  int most_nodes_;
  NodeTable table_;
  int size_ = 0;         ///< variables in use; the rest is room to grow
  GridIndex last_cell_;  ///< of the last measurement
  Eigen::VectorXd mean_, step_;
  Eigen::MatrixXd covariance_;
  Eigen::MatrixXd gain_;  ///< P H^T of one update, then whitened
};

}  // namespace vector_field_slam
