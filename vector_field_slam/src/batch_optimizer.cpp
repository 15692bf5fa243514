#include "vector_field_slam/batch_optimizer.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "field_core/errors.hpp"

namespace vector_field_slam {

using field_core::wrap_angle;

namespace {

/// Residual of a pose link with its derivatives by both poses, not yet whitened.
struct LinkRows {
  Eigen::Vector3d residual;
  Eigen::Matrix<double, 3, 6> jacobian = Eigen::Matrix<double, 3, 6>::Zero();
};

LinkRows link_rows(const PoseLink& link, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  LinkRows r;
  if (link.absolute) {
    r.residual = b - link.value.vector();
    r.residual[2] = wrap_angle(r.residual[2]);
    r.jacobian.rightCols<3>().setIdentity();
    return r;
  }
  const double c = std::cos(a[2]), s = std::sin(a[2]);
  const Eigen::Vector2d d = (b - a).head<2>();
  const Eigen::Vector2d motion(c * d.x() + s * d.y(), -s * d.x() + c * d.y());
  r.residual << motion - link.value.translation(), wrap_angle(b[2] - a[2] - link.value.yaw());
  r.jacobian << -c, -s, motion.y(), c, s, 0.0,  //
      s, -c, -motion.x(), -s, c, 0.0,           //
      0.0, 0.0, -1.0, 0.0, 0.0, 1.0;
  return r;
}

template <int M>
RobotVector start_residual(const BatchProblem<M>& problem) {
  RobotVector e;
  e << problem.poses[0], problem.offset;
  e -= problem.start_mean;
  e[2] = wrap_angle(e[2]);
  return e;
}

/// m - A1 m_far - A2 m_near of eq. (14).
template <int M>
Eigen::Matrix<double, M, 1> link_residual(const Model<M>& model, const BatchProblem<M>& problem,
                                          const typename BatchProblem<M>::NodeLink& link) {
  Eigen::Matrix<double, M, 1> expected;
  model.extrapolation.extrapolate(problem.nodes[link.far].data(), problem.nodes[link.near].data(),
                                  expected.data());
  return problem.nodes[link.node] - expected;
}

}  // namespace

Eigen::Matrix3d square_root_information(const Eigen::Matrix3d& covariance) {
  const Eigen::Matrix3d raised = covariance + kSmallestVariance * Eigen::Matrix3d::Identity();
  const Eigen::LLT<Eigen::Matrix3d> factor(raised);
  if (factor.info() != Eigen::Success) {
    throw field_core::NumericalError(
        "the covariance of a motion is not positive semi-definite; check odom_alpha1 to "
        "odom_alpha4");
  }
  return factor.matrixL().solve(Eigen::Matrix3d::Identity());
}

template <int M>
GridIndex BatchOptimizer<M>::cell_at(const BatchProblem<M>& problem,
                                     const SensorPose<double>& sensor, GridIndex fallback) const {
  GridIndex cell;
  if (!model_.grid.cell_of(sensor.x, sensor.y, cell) || cell == fallback) return fallback;
  for (int j = 0; j < 4; ++j) {
    if (problem.table.find(cell_node(cell, j)) < 0) return fallback;
  }
  return cell;
}

template <int M>
bool BatchOptimizer<M>::assign_cells(BatchProblem<M>& problem) const {
  bool changed = false;
  for (auto& m : problem.measurements) {
    const SensorPose<double> sensor(problem.poses[m.pose].data(), m.mounting);
    const GridIndex cell = cell_at(problem, sensor, m.cell);
    changed = changed || cell != m.cell;
    m.cell = cell;
  }
  return changed;
}

template <int M>
void BatchOptimizer<M>::build_pattern(const BatchProblem<M>& problem) {
  poses_ = static_cast<int>(problem.poses.size());
  nodes_ = static_cast<int>(problem.nodes.size());
  measurements_ = problem.measurements.size();
  std::vector<int> sizes(poses_, kPose);
  sizes.insert(sizes.end(), nodes_, M);
  sizes.push_back(2);
  std::vector<std::pair<int, int>> pairs;
  const auto couple = [&](const int* blocks, int count) {
    for (int i = 0; i < count; ++i) {
      for (int j = 0; j < i; ++j) pairs.emplace_back(blocks[i], blocks[j]);
    }
  };
  places_.resize(measurements_);
  for (std::size_t k = 0; k < measurements_; ++k) {
    const auto& m = problem.measurements[k];
    int* blocks = places_[k].blocks;
    blocks[0] = m.pose;
    blocks[1] = offset_block();
    for (int j = 0; j < 4; ++j) {
      blocks[2 + j] = node_block(problem.table.find(cell_node(m.cell, j)));
    }
    couple(blocks, kBlocks);
  }
  pairs.emplace_back(0, offset_block());
  for (int t = 1; t < poses_; ++t) pairs.emplace_back(t, t - 1);
  for (const auto& l : problem.node_links) {
    const int blocks[3] = {node_block(l.node), node_block(l.near), node_block(l.far)};
    couple(blocks, 3);
  }
  pattern_.build(sizes, std::move(pairs));
  for (Place& place : places_) {
    int k = 0;
    for (int i = 0; i < kBlocks; ++i) {
      for (int j = 0; j <= i; ++j) {
        place.handles[k++] = pattern_.find(place.blocks[i], place.blocks[j]);
      }
    }
  }
  has_pattern_ = true;
}

template <int M>
void BatchOptimizer<M>::prepare(BatchProblem<M>& problem) {
  const bool changed = assign_cells(problem);
  const bool same = has_pattern_ && !changed && poses_ == static_cast<int>(problem.poses.size()) &&
                    nodes_ == static_cast<int>(problem.nodes.size()) &&
                    measurements_ == problem.measurements.size();
  if (!same) build_pattern(problem);
}

/// Adds a small dense product J^T J and J^T r over some blocks of variables.
template <int M>
template <class Product, class Vector>
void BatchOptimizer<M>::add(const int* blocks, const int* sizes, int count, const Product& product,
                            const Vector& right) {
  int row = 0;
  for (int i = 0; i < count; ++i) {
    int column = 0;
    for (int j = 0; j <= i; ++j) {
      pattern_.add(pattern_.find(blocks[i], blocks[j]), blocks[i], blocks[j], product, row, column);
      column += sizes[j];
    }
    for (int a = 0; a < sizes[i]; ++a) gradient_[pattern_.first(blocks[i]) + a] += right[row + a];
    row += sizes[i];
  }
}

template <int M>
void BatchOptimizer<M>::add_start(const BatchProblem<M>& problem) {
  const int blocks[2] = {0, offset_block()}, sizes[2] = {kPose, 2};
  add(blocks, sizes, 2, problem.start_information,
      (problem.start_information * start_residual(problem)).eval());
}

template <int M>
void BatchOptimizer<M>::add_links(const BatchProblem<M>& problem) {
  const int sizes[2] = {kPose, kPose};
  for (int t = 1; t < poses_; ++t) {
    const LinkRows r = link_rows(problem.links[t], problem.poses[t - 1], problem.poses[t]);
    const Eigen::Matrix<double, 3, 6> j = problem.links[t].square_root * r.jacobian;
    const Eigen::Vector3d e = problem.links[t].square_root * r.residual;
    const int blocks[2] = {t - 1, t};
    const Eigen::Matrix<double, 6, 6> product = j.transpose() * j;
    add(blocks, sizes, 2, product, (j.transpose() * e).eval());
  }
}

template <int M>
void BatchOptimizer<M>::add_nodes(const BatchProblem<M>& problem) {
  using Square = Eigen::Matrix<double, M, M>;
  const int sizes[3] = {M, M, M};
  for (const auto& p : problem.priors) {
    const int block = node_block(p.node);
    const Square information = p.variance.cwiseInverse().asDiagonal();
    add(&block, sizes, 1, information, (information * (problem.nodes[p.node] - p.mean)).eval());
  }
  Eigen::Matrix<double, M, 3 * M> j = Eigen::Matrix<double, M, 3 * M>::Zero();
  Eigen::Matrix<double, M, 1> weight;
  for (int i = 0; i < M; ++i) {
    weight[i] = 1.0 / std::sqrt(model_.extrapolation_variance[i]);
    j(i, i) = weight[i];
    for (int k = 0; k < M; ++k) {
      const double e = model_.extrapolation.e[i][k];
      j(i, M + k) = -weight[i] * (e + (i == k ? 1.0 : 0.0));
      j(i, 2 * M + k) = weight[i] * e;
    }
  }
  const Eigen::Matrix<double, 3 * M, 3 * M> product = j.transpose() * j;
  for (const auto& l : problem.node_links) {
    const int blocks[3] = {node_block(l.node), node_block(l.near), node_block(l.far)};
    const Eigen::Matrix<double, M, 1> e = weight.cwiseProduct(link_residual(model_, problem, l));
    add(blocks, sizes, 3, product, (j.transpose() * e).eval());
  }
}

template <int M>
void BatchOptimizer<M>::rows(const BatchProblem<M>& problem,
                             const typename BatchProblem<M>::Measurement& m, GridIndex cell,
                             const SensorPose<double>& sensor,
                             Eigen::Matrix<double, M, kLocal, Eigen::RowMajor>* jacobian,
                             double* residuals) const {
  const double* values[4];
  for (int j = 0; j < 4; ++j) {
    values[j] = problem.nodes[problem.table.find(cell_node(cell, j))].data();
  }
  const Interpolation<double> at(model_.grid, cell, sensor.x, sensor.y);
  for (int k = 0; k < m.count; ++k) {
    const Observation<double>& z = problem.readings[m.first + k];
    const auto p = model_.sensor.predict(z.channel, sensor, problem.offset.data(), at, values);
    const double weight = 1.0 / std::sqrt(z.variance);
    residuals[k] = weight * (p.value - z.value);
    if (!jacobian) continue;
    local_row<double, M>(p, at, z.channel, jacobian->row(k).data());
    jacobian->row(k) *= weight;
  }
}

template <int M>
void BatchOptimizer<M>::add_measurements(const BatchProblem<M>& problem) {
  constexpr int kFirst[kBlocks] = {0, kPose, kRobot, kRobot + M, kRobot + 2 * M, kRobot + 3 * M};
  constexpr int kSize[kBlocks] = {kPose, 2, M, M, M, M};
  Eigen::Matrix<double, M, kLocal, Eigen::RowMajor> j;
  Eigen::Matrix<double, M, 1> e;
  for (std::size_t k = 0; k < measurements_; ++k) {
    const auto& m = problem.measurements[k];
    const SensorPose<double> sensor(problem.poses[m.pose].data(), m.mounting);
    j.setZero();
    e.setZero();
    rows(problem, m, m.cell, sensor, &j, e.data());
    Local product;
    product.noalias() = j.transpose() * j;
    const LocalVector right = j.transpose() * e;
    const Place& place = places_[k];
    const int* handle = place.handles;
    for (int a = 0; a < kBlocks; ++a) {
      for (int b = 0; b <= a; ++b) {
        pattern_.add(*handle++, place.blocks[a], place.blocks[b], product, kFirst[a], kFirst[b]);
      }
      for (int i = 0; i < kSize[a]; ++i) {
        gradient_[pattern_.first(place.blocks[a]) + i] += right[kFirst[a] + i];
      }
    }
  }
}

template <int M>
void BatchOptimizer<M>::linearize(const BatchProblem<M>& problem) {
  std::fill_n(pattern_.matrix().valuePtr(), pattern_.matrix().nonZeros(), 0.0);
  gradient_.setZero(pattern_.variables());
  add_start(problem);
  add_links(problem);
  add_nodes(problem);
  add_measurements(problem);
}

template <int M>
double BatchOptimizer<M>::cost(const BatchProblem<M>& problem) const {
  return cost(problem, Cells::those_of_the_poses);
}

template <int M>
double BatchOptimizer<M>::cost(const BatchProblem<M>& problem, Cells cells) const {
  const RobotVector start = start_residual(problem);
  double sum = start.dot(problem.start_information * start);
  for (std::size_t t = 1; t < problem.poses.size(); ++t) {
    const LinkRows r = link_rows(problem.links[t], problem.poses[t - 1], problem.poses[t]);
    sum += (problem.links[t].square_root * r.residual).squaredNorm();
  }
  for (const auto& p : problem.priors) {
    sum += (problem.nodes[p.node] - p.mean).cwiseAbs2().cwiseQuotient(p.variance).sum();
  }
  const Eigen::Map<const Eigen::Matrix<double, M, 1>> spread(model_.extrapolation_variance);
  for (const auto& l : problem.node_links) {
    sum += link_residual(model_, problem, l).cwiseAbs2().cwiseQuotient(spread).sum();
  }
  Eigen::Matrix<double, M, 1> e;
  for (const auto& m : problem.measurements) {
    e.setZero();
    const SensorPose<double> sensor(problem.poses[m.pose].data(), m.mounting);
    const bool kept = cells == Cells::kept;
    rows(problem, m, kept ? m.cell : cell_at(problem, sensor, m.cell), sensor, nullptr, e.data());
    sum += e.squaredNorm();
  }
  return 0.5 * sum;
}

template <int M>
void BatchOptimizer<M>::move(const BatchProblem<M>& from, const Eigen::VectorXd& step,
                             BatchProblem<M>& to) const {
  for (int t = 0; t < poses_; ++t) {
    to.poses[t] = from.poses[t] + step.segment<kPose>(kPose * t);
    to.poses[t][2] = wrap_angle(to.poses[t][2]);
  }
  for (int i = 0; i < nodes_; ++i) {
    to.nodes[i] = from.nodes[i] + step.segment<M>(kPose * poses_ + M * i);
  }
  to.offset = from.offset + step.tail<2>();
}

template <int M>
void BatchOptimizer<M>::step(BatchProblem<M>& problem, BatchProblem<M>& trial) {
  linearize(problem);
  factor_.factorize(pattern_.matrix());
  const Eigen::VectorXd step = -factor_.solve(gradient_);
  slope_ = -step.dot(gradient_);  // > 0: twice what the linear model promises
  for (std::size_t k = 0; k < problem.measurements.size(); ++k) {
    trial.measurements[k].cell = problem.measurements[k].cell;
  }
  const double before = cost(problem, Cells::kept);
  constexpr double kShortest = 1e-3;
  for (double length = 1.0; length > kShortest; length *= 0.5) {
    move(problem, length * step, trial);
    const double gained = before - cost(trial, Cells::kept);
    if (gained >= 0.1 * length * slope_ * (1.0 - 0.5 * length)) break;
  }
}

template <int M>
BatchReport BatchOptimizer<M>::optimize(BatchProblem<M>& problem, const BatchOptions& options) {
  BatchReport report;
  report.initial_cost = report.cost = cost(problem);
  BatchProblem<M> trial = problem, best = problem;
  int in_vain = 0;  // iterations in a row
  while (report.iterations < options.most_iterations && !report.converged) {
    prepare(problem);
    step(problem, trial);
    ++report.iterations;
    std::swap(problem.poses, trial.poses);
    std::swap(problem.nodes, trial.nodes);
    problem.offset = trial.offset;
    const double now = cost(problem);
    in_vain = now < report.cost - options.tolerance * report.cost ? 0 : in_vain + 1;
    if (now < report.cost) {
      report.cost = now;
      best = problem;
    }
    report.converged = in_vain >= 2 || slope_ <= options.tolerance * report.cost;
  }
  problem = std::move(best);
  return report;
}

template <int M>
Eigen::VectorXd BatchOptimizer<M>::gradient(BatchProblem<M>& problem) {
  prepare(problem);
  linearize(problem);
  return gradient_;
}

template <int M>
const Eigen::SparseMatrix<double>& BatchOptimizer<M>::information(BatchProblem<M>& problem) {
  prepare(problem);
  linearize(problem);
  return pattern_.matrix();
}

template <int M>
Eigen::MatrixXd BatchOptimizer<M>::covariance(BatchProblem<M>& problem,
                                              const std::vector<int>& variables) {
  factor_.factorize(information(problem));
  const auto count = static_cast<Eigen::Index>(variables.size());
  Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(problem.variables(), count);
  for (Eigen::Index i = 0; i < count; ++i) unit(variables[i], i) = 1.0;
  const Eigen::MatrixXd columns = factor_.solve(unit);
  Eigen::MatrixXd result(count, count);
  for (Eigen::Index i = 0; i < count; ++i) result.row(i) = columns.row(variables[i]);
  return 0.5 * (result + result.transpose());
}

template class BatchOptimizer<1>;
template class BatchOptimizer<2>;
template class BatchOptimizer<3>;
template class BatchOptimizer<4>;
template class BatchOptimizer<5>;
template class BatchOptimizer<6>;
template class BatchOptimizer<7>;
template class BatchOptimizer<8>;

}  // namespace vector_field_slam
