#include "vector_field_slam/batch_log.hpp"

#include <Eigen/Cholesky>

#include "field_core/errors.hpp"
#include "vector_field_slam/node_extrapolation.hpp"

namespace vector_field_slam {

using field_core::SE2;

template <int M>
void BatchLog<M>::start(const StartState& state) {
  problem_ = BatchProblem<M>();
  next_ = PoseLink();
  covariance_.setZero();
  problem_.start_mean = state.robot;
  const Eigen::LLT<RobotMatrix> factor(state.covariance);
  if (factor.info() != Eigen::Success) {
    throw field_core::NumericalError(
        "the covariance of the start is not positive definite; raise initial_cov_xx, _yy, _aa");
  }
  problem_.start_information = factor.solve(RobotMatrix::Identity());
  problem_.poses.emplace_back(state.robot.head<kPose>());
  problem_.links.emplace_back();  // of the first pose: not used
  problem_.offset = state.robot.tail<2>();
  const Eigen::Map<const Eigen::Matrix<double, M, 1>> variance(model_.prior_variance);
  for (int j = 0; j < 4; ++j) {
    problem_.nodes.emplace_back(state.node_values.col(j));
    problem_.priors.push_back({j, problem_.nodes.back(), variance});
    problem_.table.insert(cell_node(state.cell, j));
  }
}

template <int M>
void BatchLog<M>::move(const Eigen::Vector3d& pose, const OdometryStep<double>& step) {
  const SE2 before(pose),
      motion = before.between(SE2(pose.x() + step.dx, pose.y() + step.dy, pose.z() + step.dyaw));
  const Eigen::Matrix2d back = before.rotation().transpose();
  Eigen::Matrix3d noise =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(step.noise[0]);
  noise.topRows<2>() = (back * noise.topRows<2>()).eval();
  noise.leftCols<2>() = (noise.leftCols<2>() * back.transpose()).eval();
  const Eigen::Matrix3d first = SE2::compose_jacobian_first(next_.value, motion),
                        second = SE2::compose_jacobian_second(next_.value, motion);
  covariance_ = first * covariance_ * first.transpose() + second * noise * second.transpose();
  next_.value = next_.value * motion;
}

template <int M>
void BatchLog<M>::set_pose(const SE2& pose, const Eigen::Matrix3d& covariance) {
  next_.absolute = true;
  next_.value = pose;
  covariance_ = covariance;
}

template <int M>
void BatchLog<M>::observe(const Mounting<double>& mounting, const Observation<double>* observations,
                          int count, const Solver& after) {
  const RobotVector robot = after.robot();
  next_.square_root = square_root_information(covariance_);
  problem_.links.push_back(next_);
  problem_.poses.push_back(
      (next_.absolute ? next_.value : SE2(problem_.poses.back()) * next_.value).vector());
  next_ = PoseLink();
  covariance_.setZero();
  add_nodes(after);
  GridIndex cell;
  const SensorPose<double> sensor(robot.data(), mounting);
  bool known = model_.grid.cell_of(sensor.x, sensor.y, cell);
  for (int j = 0; j < 4; ++j) known = known && problem_.table.find(cell_node(cell, j)) >= 0;
  if (!known)
    cell =
        problem_.measurements.empty() ? problem_.table.index(0) : problem_.measurements.back().cell;
  const int first = static_cast<int>(problem_.readings.size());
  problem_.readings.insert(problem_.readings.end(), observations, observations + count);
  problem_.measurements.push_back(
      {static_cast<int>(problem_.poses.size()) - 1, mounting, first, count, cell});
}

/// The online solver has numbered its new nodes in the order in which it made them, each from the
/// nodes before: the same search finds the same sources.
template <int M>
void BatchLog<M>::add_nodes(const Solver& solver) {
  const auto find = [this](GridIndex index) { return problem_.table.find(index); };
  const Eigen::Map<const Eigen::Matrix<double, M, 1>> variance(model_.prior_variance);
  for (int node = problem_.table.size(); node < solver.node_count(); ++node) {
    const GridIndex index = solver.node_index(node);
    const ExtrapolationSource source = extrapolation_source(index, find);
    problem_.nodes.emplace_back(
        Eigen::Map<const Eigen::Matrix<double, M, 1>>(solver.node_values(node)));
    if (source.near >= 0) {
      problem_.node_links.push_back({node, source.near, source.far});
    } else {
      problem_.priors.push_back({node, problem_.nodes.back(), variance});
    }
    problem_.table.insert(index);
  }
}

template class BatchLog<1>;
template class BatchLog<2>;
template class BatchLog<3>;
template class BatchLog<4>;
template class BatchLog<5>;
template class BatchLog<6>;
template class BatchLog<7>;
template class BatchLog<8>;

}  // namespace vector_field_slam
