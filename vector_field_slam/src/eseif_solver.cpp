#include "vector_field_slam/eseif_solver.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

#include "solver_common.hpp"

namespace vector_field_slam {
namespace {

template <int M>
EseifConfig<double, M> make_config(const Model<M>& model, const EseifOptions& options) {
  EseifConfig<double, M> c{model.grid, model.sensor, model.extrapolation, {}, {}};
  for (int i = 0; i < M; ++i) {
    c.prior_variance[i] = model.prior_variance[i];
    c.extrapolation_variance[i] = model.extrapolation_variance[i];
  }
  c.gate = options.gate;
  c.underweighting = options.underweighting;
  c.relocation = options.relocation;
  for (int i = 0; i < kRobot; ++i) c.relocation_variance[i] = options.relocation_variance[i];
  c.rings = options.rings;
  return c;
}

using RowMatrix = Eigen::Matrix<double, kRobot, kRobot, Eigen::RowMajor>;

}  // namespace

template <int M>
EseifSolver<M>::EseifSolver(const Model<M>& model, const EseifOptions& options)
    : filter_(make_config(model, options)) {
  filter_.state().map.set_capacity(options.most_nodes);
}

template <int M>
void EseifSolver<M>::start(const StartState& state) {
  double values[4][M];
  for (int j = 0; j < 4; ++j) {
    for (int i = 0; i < M; ++i) values[j][i] = state.node_values(i, j);
  }
  const RowMatrix covariance = state.covariance;
  if (!filter_.start(state.robot.data(), covariance.data(), state.cell, values)) {
    throw_not_positive();
  }
}

template <int M>
void EseifSolver<M>::move(const OdometryStep<double>& step, double calibration_variance) {
  if (!filter_.move(step, calibration_variance)) throw_not_positive();
}

template <int M>
field_core::UpdateResult EseifSolver<M>::observe(const Mounting<double>& mounting,
                                                 const Observation<double>* observations,
                                                 int count) {
  const auto report = filter_.observe(mounting, observations, count);
  switch (report.outcome) {
    case EseifOutcome::gated:
      return field_core::UpdateResult::skipped(kGated);
    case EseifOutcome::no_place:
      return field_core::UpdateResult::skipped(kNoPlace);
    case EseifOutcome::map_full:
      return field_core::UpdateResult::skipped(kMapFull);
    case EseifOutcome::not_positive:
      throw_not_positive();
    case EseifOutcome::applied:
      break;
  }
  return {true, "", report.nis, report.used};
}

template <int M>
void EseifSolver<M>::set_pose(const field_core::SE2& pose, const Eigen::Matrix3d& covariance) {
  RobotVector mean = robot();
  mean.head<kPose>() = pose.vector();
  RowMatrix all = robot_covariance();
  all.topRows<kPose>().setZero();
  all.leftCols<kPose>().setZero();
  all.topLeftCorner<kPose, kPose>() = covariance;
  if (!filter_.set_robot(mean.data(), all.data())) throw_not_positive();
}

template <int M>
void EseifSolver<M>::set_mean(const RobotVector& robot,
                              const std::vector<Eigen::Matrix<double, M, 1>>& nodes) {
  auto& state = filter_.state();
  for (int i = 0; i < kRobot; ++i) state.robot[i] = robot[i];
  state.robot[2] = field_core::wrap_angle(robot[2]);
  for (int n = 0; n < node_count(); ++n) {
    auto& node = state.map.node(n);
    for (int i = 0; i < M; ++i) {
      node.mean[i] = nodes[n][i];
      node.residual[i] = 0.0;
    }
  }
  std::fill_n(state.drift, 4 * M, 0.0);
  const RowMatrix covariance = robot_covariance();
  if (!filter_.resume(covariance.data())) throw_not_positive();
}

template <int M>
void EseifSolver<M>::start_channel(int channel, double value) {
  // Residuals are relative to the mean, and nothing was measured of this channel: they stay.
  auto& map = filter_.state().map;
  for (int i = 0; i < map.size(); ++i) map.node(i).mean[channel] = value;
}

template <int M>
RobotVector EseifSolver<M>::robot() const {
  return Eigen::Map<const RobotVector>(filter_.state().robot);
}

template <int M>
RobotMatrix EseifSolver<M>::robot_covariance() const {
  return Eigen::Map<const RobotMatrix>(filter_.robot_covariance());
}

template <int M>
Eigen::MatrixXd EseifSolver<M>::map_information(const std::vector<int>& nodes) const {
  const auto& state = filter_.state();
  const auto count = static_cast<int>(nodes.size());
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(M * count, M * count);
  std::vector<int> place(4, -1);  // of the active nodes
  for (int i = 0; i < count; ++i) {
    const auto& node = state.map.node(nodes[i]);
    for (int p = 0; p < M; ++p) {
      for (int q = p; q < M; ++q) {
        a(M * i + p, M * i + q) = a(M * i + q, M * i + p) = node.information[packed(M, p, q)];
      }
    }
    for (int d = 0; d < kForward; ++d) {
      if (node.edge[d] == GrowingMap<double, M>::kNoEdge) continue;
      const int other = find(offset(node.index, kForwardSteps[d][0], kForwardSteps[d][1]));
      const auto j = std::find(nodes.begin(), nodes.end(), other) - nodes.begin();
      if (j == count) continue;
      const Eigen::Map<const Eigen::Matrix<double, M, M, Eigen::RowMajor>> block(
          state.map.edge(node.edge[d]));
      a.block(M * i, M * j, M, M) = block;
      a.block(M * j, M * i, M, M) = block.transpose();
    }
    const auto* const active = std::find(state.active, state.active + 4, nodes[i]);
    if (active != state.active + 4) place[active - state.active] = i;
  }
  // Marginalizing the robot, eq. (32).
  Eigen::MatrixXd cross = Eigen::MatrixXd::Zero(kRobot, M * count);
  RowMatrix robot;
  state.robot_information(robot.data());
  for (int j = 0; j < 4; ++j) {
    for (int r = 0; r < kRobot && place[j] >= 0; ++r) {
      for (int p = 0; p < M; ++p) cross(r, M * place[j] + p) = state.cross[r][j * M + p];
    }
  }
  a.noalias() -= cross.transpose() * robot.llt().solve(cross);
  return a;
}

template <int M>
Eigen::MatrixXd EseifSolver<M>::node_covariance(const std::vector<int>& nodes) const {
  std::vector<int> members = nodes;  // then what surrounds them
  for (int node : nodes) {
    for (int d = 0; d < 9; ++d) {
      const int other = find(offset(node_index(node), d % 3 - 1, d / 3 - 1));
      if (other < 0 || std::find(members.begin(), members.end(), other) != members.end()) continue;
      members.push_back(other);
    }
  }
  const Eigen::Index n = M * static_cast<Eigen::Index>(nodes.size());
  const Eigen::MatrixXd information = map_information(members);
  const Eigen::LLT<Eigen::MatrixXd> factor(information);
  if (factor.info() != Eigen::Success) throw_not_positive();
  return factor.solve(Eigen::MatrixXd::Identity(information.rows(), n)).topRows(n);
}

template <int M>
Eigen::MatrixXd EseifSolver<M>::information() const {
  const auto& state = filter_.state();
  const int n = kRobot + M * node_count();
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, n);
  RowMatrix robot;
  state.robot_information(robot.data());
  a.topLeftCorner<kRobot, kRobot>() = robot;
  for (int j = 0; j < 4; ++j) {
    for (int r = 0; r < kRobot; ++r) {
      for (int p = 0; p < M; ++p) {
        const int column = kRobot + M * state.active[j] + p;
        a(r, column) = a(column, r) = state.cross[r][j * M + p];
      }
    }
  }
  for (int i = 0; i < node_count(); ++i) {
    const auto& node = state.map.node(i);
    const int at = kRobot + M * i;
    for (int p = 0; p < M; ++p) {
      for (int q = p; q < M; ++q) {
        a(at + p, at + q) = a(at + q, at + p) = node.information[packed(M, p, q)];
      }
    }
    for (int d = 0; d < kForward; ++d) {
      if (node.edge[d] == GrowingMap<double, M>::kNoEdge) continue;
      const int j = find(offset(node.index, kForwardSteps[d][0], kForwardSteps[d][1]));
      const Eigen::Map<const Eigen::Matrix<double, M, M, Eigen::RowMajor>> block(
          state.map.edge(node.edge[d]));
      a.block(at, kRobot + M * j, M, M) = block;
      a.block(kRobot + M * j, at, M, M) = block.transpose();
    }
  }
  return a;
}

template <int M>
void EseifSolver<M>::save(field_core::State& state) const {
  const auto& s = filter_.state();
  constexpr int kPacked = M * (M + 1) / 2;
  save_node_indices(*this, state);
  Eigen::MatrixXd nodes(2 * M + kPacked + kForward, node_count());
  for (int i = 0; i < node_count(); ++i) {
    const auto& node = s.map.node(i);
    auto column = nodes.col(i);
    column.head<M>() = Eigen::Map<const Eigen::Matrix<double, M, 1>>(node.mean);
    column.segment<M>(M) = Eigen::Map<const Eigen::Matrix<double, M, 1>>(node.residual);
    for (int k = 0; k < kPacked; ++k) column[2 * M + k] = node.information[k];
    for (int d = 0; d < kForward; ++d) column[2 * M + kPacked + d] = node.edge[d];
  }
  state.set("nodes", nodes);
  Eigen::MatrixXd edges(M * M, s.map.edge_count());
  for (int e = 0; e < s.map.edge_count(); ++e) {
    edges.col(e) = Eigen::Map<const Eigen::Matrix<double, M * M, 1>>(s.map.edge(e));
  }
  state.set("edges", edges);
  state.set("robot", robot());
  state.set("robot_covariance", robot_covariance());
  state.set("robot_information",
            Eigen::Map<const Eigen::VectorXd>(s.information, Filter::State::kRobotPacked));
  state.set("cross", Eigen::Map<const Eigen::MatrixXd>(s.cross[0], 4 * M, kRobot));
  state.set("drift", Eigen::Map<const Eigen::VectorXd>(s.drift, 4 * M));
  state.set("cell", Eigen::Vector2d(s.cell.x, s.cell.y));
}

template <int M>
void EseifSolver<M>::restore(const field_core::State& state) {
  constexpr int kPacked = M * (M + 1) / 2;
  const std::vector<GridIndex> indices = load_node_indices(state);
  const auto count = static_cast<Eigen::Index>(indices.size());
  const Eigen::MatrixXd &nodes = state.matrix("nodes", 2 * M + kPacked + kForward, count),
                        &edges = state.matrix("edges", M * M, -1),
                        &robot = state.matrix("robot", kRobot, 1),
                        &covariance = state.matrix("robot_covariance", kRobot, kRobot),
                        &information =
                            state.matrix("robot_information", Filter::State::kRobotPacked, 1),
                        &cross = state.matrix("cross", 4 * M, kRobot),
                        &drift = state.matrix("drift", 4 * M, 1),
                        &cell = state.matrix("cell", 2, 1);
  auto restored = std::make_unique<EseifSolver>(*this);  // to change nothing if anything is wrong
  auto& s = restored->filter_.state();
  s.map.clear();
  s.cell = {static_cast<std::int16_t>(cell(0)), static_cast<std::int16_t>(cell(1))};
  for (GridIndex i : indices) s.map.add(i);
  std::vector<std::pair<int, int>> owners(edges.cols(), {-1, -1});
  for (Eigen::Index i = 0; i < count; ++i) {
    auto& node = s.map.node(static_cast<int>(i));
    for (int p = 0; p < M; ++p) {
      node.mean[p] = nodes(p, i);
      node.residual[p] = nodes(M + p, i);
    }
    for (int k = 0; k < kPacked; ++k) node.information[k] = nodes(2 * M + k, i);
    for (int d = 0; d < kForward; ++d) {
      const double e = nodes(2 * M + kPacked + d, i);
      if (e >= 0.0 && e < static_cast<double>(owners.size())) {
        owners[static_cast<std::size_t>(e)] = {static_cast<int>(i), d};
      }
    }
  }
  for (std::size_t e = 0; e < owners.size(); ++e) {
    if (owners[e].first < 0) {
      throw field_core::DataError("state block 'edges': block " + std::to_string(e) +
                                  " belongs to no node; the file is damaged");
    }
    s.map.connect(owners[e].first, owners[e].second);
    for (int k = 0; k < M * M; ++k) {
      s.map.edge(static_cast<int>(e))[k] = edges(k, static_cast<Eigen::Index>(e));
    }
  }
  for (int j = 0; j < 4; ++j) {
    s.active[j] = s.map.find(cell_node(s.cell, j));
    if (s.active[j] < 0) {
      throw field_core::DataError("state block 'cell': its nodes are missing; the file is damaged");
    }
  }
  for (int r = 0; r < kRobot; ++r) {
    s.robot[r] = robot(r);
    for (int i = 0; i < 4 * M; ++i) s.cross[r][i] = cross(i, r);
  }
  for (int k = 0; k < Filter::State::kRobotPacked; ++k) s.information[k] = information(k);
  for (int i = 0; i < 4 * M; ++i) s.drift[i] = drift(i);
  const RowMatrix all = covariance;
  if (!restored->filter_.resume(all.data())) {
    throw field_core::DataError("the state's information matrix is not positive definite");
  }
  filter_ = restored->filter_;
}

template class EseifSolver<1>;
template class EseifSolver<2>;
template class EseifSolver<3>;
template class EseifSolver<4>;
template class EseifSolver<5>;
template class EseifSolver<6>;
template class EseifSolver<7>;
template class EseifSolver<8>;

}  // namespace vector_field_slam
