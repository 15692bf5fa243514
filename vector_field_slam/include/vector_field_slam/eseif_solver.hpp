// The exactly sparse information filter as a solver of the host: Eseif with a map that grows.
#pragma once

#include "vector_field_slam/eseif.hpp"
#include "vector_field_slam/growing_map.hpp"
#include "vector_field_slam/solver.hpp"

namespace vector_field_slam {

/// How the filter changes cells, beside the model.
struct EseifOptions {
  double gate = 0.0;  ///< largest squared innovation, in its variance, that is believed; 0: any
  double underweighting = 0.0;
  Relocation relocation = Relocation::window;
  RobotVector relocation_variance = RobotVector::Zero();  ///< R0, for Relocation::blank
  int rings = 1;
  int most_nodes = 1 << 20;
};

/// Constant time per step; memory linear in the nodes.
template <int M>
class EseifSolver final : public Solver {
 public:
  static constexpr int kMostRings = 2;
  using Filter = Eseif<double, M, GrowingMap<double, M>, kMostRings>;

  EseifSolver(const Model<M>& model, const EseifOptions& options);

  void start(const StartState& state) override;
  void move(const OdometryStep<double>& step, double calibration_variance) override;
  field_core::UpdateResult observe(const Mounting<double>& mounting,
                                   const Observation<double>* observations, int count) override;
  void set_pose(const field_core::SE2& pose, const Eigen::Matrix3d& covariance) override;

  void start_channel(int channel, double value) override;

  RobotVector robot() const override;
  RobotMatrix robot_covariance() const override;
  int node_count() const override { return filter_.state().map.size(); }
  GridIndex node_index(int node) const override { return filter_.state().map.node(node).index; }
  int find(GridIndex index) const override { return filter_.state().map.find(index); }
  const double* node_values(int node) const override { return filter_.state().map.node(node).mean; }
  /// Given all nodes beyond one ring around those asked for; the robot is marginalized out.
  Eigen::MatrixXd node_covariance(const std::vector<int>& nodes) const override;

  /// Better means from elsewhere: robot and nodes are set, the information is kept, and nothing of
  /// the mean waits to be recovered any more. @param nodes M values for each node. O(nodes)
  void set_mean(const RobotVector& robot, const std::vector<Eigen::Matrix<double, M, 1>>& nodes);

  void save(field_core::State& state) const override;
  void restore(const field_core::State& state) override;

  /// Lambda over (robot, nodes in the order of their numbers), dense: for tests. O(n^2)
  Eigen::MatrixXd information() const;
  const Filter& filter() const { return filter_; }

 private:
  /// Information of some nodes after the robot is marginalized out.
  Eigen::MatrixXd map_information(const std::vector<int>& nodes) const;

  Filter filter_;
};

}  // namespace vector_field_slam
