#include "vector_field_slam/ekf_solver.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

#include "field_core/errors.hpp"
#include "solver_common.hpp"

namespace vector_field_slam {

namespace {

/// 1/2 tr(W P W P). @param p over robot and the cell's nodes
template <int M>
double curvature_variance(const Curvature<double, M>& curvature,
                          const Eigen::Matrix<double, kRobot + 4 * M, kRobot + 4 * M>& p) {
  Eigen::Matrix<double, kPose, kRobot + 4 * M, Eigen::RowMajor> a;
  for (int i = 0; i < kPose; ++i) {
    a.row(i).template head<kRobot>() = Eigen::Map<const RobotVector>(curvature.robot[i]);
    a.row(i).template tail<4 * M>() =
        Eigen::Map<const Eigen::Matrix<double, 4 * M, 1>>(curvature.nodes[i]);
  }
  using Matrix = Eigen::Matrix<double, kPose, kPose, Eigen::RowMajor>;
  const Eigen::Matrix<double, kPose, kRobot + 4 * M> ap = a * p;
  const Matrix ee = p.template topLeftCorner<kPose, kPose>(),
               ea = ap.template leftCols<kPose>().transpose(), aa = ap * a.transpose();
  return ee.cwiseProduct(aa).sum() + ea.cwiseProduct(ea.transpose()).sum();
}

}  // namespace

template <int M>
EkfSolver<M>::EkfSolver(const Model<M>& model, double gate, int most_nodes, double underweighting)
    : model_(model), gate_(gate), underweighting_(underweighting), most_nodes_(most_nodes) {}

template <int M>
void EkfSolver<M>::reserve(int variables) {
  if (variables <= mean_.size()) return;
  const Eigen::Index room = std::max<Eigen::Index>(variables, 2 * mean_.size());
  mean_.conservativeResize(room);
  covariance_.conservativeResize(room, room);
  gain_.resize(room, M);
  step_.resize(room);
}

template <int M>
void EkfSolver<M>::start(const StartState& state) {
  table_.clear();
  size_ = kRobot;
  last_cell_ = state.cell;
  reserve(first(16));
  mean_.head<kRobot>() = state.robot;
  covariance_.topLeftCorner<kRobot, kRobot>() = state.covariance;
  const Values variance = Eigen::Map<const Values>(model_.prior_variance);
  for (int j = 0; j < 4; ++j) {
    append(cell_node(state.cell, j), state.node_values.col(j), variance);
  }
}

template <int M>
void EkfSolver<M>::append(GridIndex index, const Values& mean, const Values& variance) {
  const int at = size_;
  reserve(at + M);
  mean_.segment<M>(at) = mean;
  covariance_.block(at, 0, M, at).setZero();
  covariance_.block(0, at, at, M).setZero();
  covariance_.block<M, M>(at, at) = variance.asDiagonal();
  size_ += M;
  table_.insert(index);
}

/// Eq. (14), with the exact covariance.
template <int M>
void EkfSolver<M>::extrapolate(GridIndex index, ExtrapolationSource source) {
  Eigen::Matrix<double, M, M> a1, a2;
  for (int i = 0; i < M; ++i) {
    for (int k = 0; k < M; ++k) {
      a1(i, k) = -model_.extrapolation.e[i][k];
      a2(i, k) = model_.extrapolation.e[i][k] + (i == k ? 1.0 : 0.0);
    }
  }
  const int at = size_, far = first(source.far), near = first(source.near);
  append(index, a1 * mean_.segment<M>(far) + a2 * mean_.segment<M>(near),
         Eigen::Map<const Values>(model_.extrapolation_variance));
  auto rows = covariance_.block(at, 0, M, at);
  rows.noalias() = a1 * covariance_.block(far, 0, M, at);
  rows.noalias() += a2 * covariance_.block(near, 0, M, at);
  covariance_.block(0, at, at, M) = rows.transpose();
  covariance_.block<M, M>(at, at) +=
      rows.block(0, far, M, M) * a1.transpose() + rows.block(0, near, M, M) * a2.transpose();
}

template <int M>
void EkfSolver<M>::move(const OdometryStep<double>& step, double calibration_variance) {
  mean_[0] += step.dx;
  mean_[1] += step.dy;
  mean_[2] = field_core::wrap_angle(mean_[2] + step.dyaw);
  auto p = covariance_.topLeftCorner(size_, size_);
  p.row(0) -= step.dy * p.row(2);
  p.row(1) += step.dx * p.row(2);
  p.col(0) -= step.dy * p.col(2);
  p.col(1) += step.dx * p.col(2);
  for (int i = 0; i < kPose; ++i) {
    for (int j = 0; j < kPose; ++j) p(i, j) += step.noise[i][j];
  }
  p(3, 3) += calibration_variance;
  p(4, 4) += calibration_variance;
}

template <int M>
bool EkfSolver<M>::enter(GridIndex cell, const Values& unknown_values) {
  int missing = 0;
  for (int j = 0; j < 4; ++j) missing += find(cell_node(cell, j)) < 0;
  if (node_count() + missing > most_nodes_) return false;
  const auto lookup = [this](GridIndex i) { return find(i); };
  for (; missing > 0; --missing) {
    const NewNode next = next_new_node(cell, lookup);
    if (next.source.near >= 0) {
      extrapolate(next.index, next.source);
    } else {
      append(next.index, unknown_values, Eigen::Map<const Values>(model_.prior_variance));
    }
  }
  return true;
}

template <int M>
void EkfSolver<M>::find_nodes(GridIndex cell, int* nodes, const double** values) const {
  for (int j = 0; j < 4; ++j) {
    nodes[j] = find(cell_node(cell, j));
    values[j] = nodes[j] < 0 ? nullptr : node_values(nodes[j]);
  }
}

template <int M>
void EkfSolver<M>::project(const double* row, const int* nodes,
                           Eigen::Ref<Eigen::VectorXd> column) const {
  column.setZero();
  for (int i = 0; i < kRobot; ++i) column += row[i] * covariance_.col(i).head(size_);
  for (int j = 0; j < 4; ++j) {
    for (int i = 0; i < M; ++i) {
      const double h = row[kRobot + j * M + i];
      if (h != 0.0) column += h * covariance_.col(first(nodes[j]) + i).head(size_);
    }
  }
}

template <int M>
double EkfSolver<M>::correlate(const double* row, const int* nodes,
                               const Eigen::Ref<const Eigen::VectorXd>& column) const {
  double sum = 0.0;
  for (int i = 0; i < kRobot; ++i) sum += row[i] * column[i];
  for (int j = 0; j < 4; ++j) {
    for (int i = 0; i < M; ++i) sum += row[kRobot + j * M + i] * column[first(nodes[j]) + i];
  }
  return sum;
}

template <int M>
typename EkfSolver<M>::LocalMatrix EkfSolver<M>::local_covariance(const int* nodes) const {
  int at[kRobot + 4 * M];
  for (int i = 0; i < kRobot; ++i) at[i] = i;
  for (int i = 0; i < 4 * M; ++i) at[kRobot + i] = first(nodes[i / M]) + i % M;
  LocalMatrix p;
  for (int i = 0; i < p.rows(); ++i) {
    for (int j = 0; j < p.cols(); ++j) p(i, j) = covariance_(at[i], at[j]);
  }
  return p;
}

template <int M>
field_core::UpdateResult EkfSolver<M>::observe(const Mounting<double>& mounting,
                                               const Observation<double>* observations, int count) {
  const SensorPose<double> sensor(mean_.data(), mounting);
  GridIndex cell;
  if (!model_.grid.cell_of(sensor.x, sensor.y, cell)) {
    return field_core::UpdateResult::skipped(kNoPlace);
  }
  int nodes[4];
  const double* values[4];
  find_nodes(cell, nodes, values);
  if (*std::min_element(nodes, nodes + 4) < 0) {
    const double* last_values[4];
    find_nodes(last_cell_, nodes, last_values);
    Values unknown;
    suggested_values(model_.sensor, model_.grid, sensor, mean_.data() + kPose, observations, count,
                     last_values, unknown.data());
    if (!enter(cell, unknown)) return field_core::UpdateResult::skipped(kMapFull);
    find_nodes(cell, nodes, values);
  }
  last_cell_ = cell;

  const Interpolation<double> at(model_.grid, cell, sensor.x, sensor.y);
  double rows[M][kRobot + 4 * M], innovation[M], variances[M];
  const LocalMatrix local = underweighting_ > 0.0 ? local_covariance(nodes) : LocalMatrix();
  int used = 0;
  for (int k = 0; k < count; ++k) {
    const auto p =
        model_.sensor.predict(observations[k].channel, sensor, mean_.data() + kPose, at, values);
    local_row<double, M>(p, at, observations[k].channel, rows[used]);
    project(rows[used], nodes, gain_.col(used).head(size_));
    variances[used] = observations[k].variance;
    if (underweighting_ > 0.0) {
      variances[used] += underweighting_ *
                         curvature_variance<M>(
                             {model_.sensor, observations[k].channel, sensor, at, values}, local);
    }
    const double variance = correlate(rows[used], nodes, gain_.col(used)) + variances[used];
    innovation[used] = observations[k].value - p.value;
    if (gate_ > 0.0 && innovation[used] * innovation[used] > gate_ * variance) continue;
    ++used;
  }
  if (used == 0) return field_core::UpdateResult::skipped(kGated);

  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostChannels, kMostChannels> s(used,
                                                                                           used);
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostChannels, 1> nu(used);
  for (int k = 0; k < used; ++k) {
    nu[k] = innovation[k];
    for (int l = 0; l < used; ++l) s(k, l) = correlate(rows[k], nodes, gain_.col(l));
    s(k, k) += variances[k];
  }
  const Eigen::LLT<decltype(s)> factor(s);
  if (factor.info() != Eigen::Success) throw_not_positive();
  factor.matrixL().solveInPlace(nu);
  auto gain = gain_.topLeftCorner(size_, used);
  factor.matrixU().template solveInPlace<Eigen::OnTheRight>(gain);  // P H^T L^-T
  mean_.head(size_).noalias() += gain * nu;
  mean_[2] = field_core::wrap_angle(mean_[2]);
  auto p = covariance_.topLeftCorner(size_, size_);
  p.template selfadjointView<Eigen::Lower>().rankUpdate(gain, -1.0);
  p.template triangularView<Eigen::StrictlyUpper>() = p.transpose();
  return {true, "", nu.squaredNorm(), used};
}

template <int M>
void EkfSolver<M>::set_pose(const field_core::SE2& pose, const Eigen::Matrix3d& covariance) {
  mean_.head<kPose>() = pose.vector();
  covariance_.topRows(kPose).leftCols(size_).setZero();
  covariance_.leftCols(kPose).topRows(size_).setZero();
  covariance_.topLeftCorner<kPose, kPose>() = covariance;
}

template <int M>
void EkfSolver<M>::start_channel(int channel, double value) {
  for (int i = 0; i < node_count(); ++i) mean_[first(i) + channel] = value;
}

template <int M>
Eigen::MatrixXd EkfSolver<M>::node_covariance(const std::vector<int>& nodes) const {
  const auto count = static_cast<Eigen::Index>(nodes.size());
  Eigen::MatrixXd result(M * count, M * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j < count; ++j) {
      result.block<M, M>(M * i, M * j) = covariance_.block<M, M>(first(nodes[i]), first(nodes[j]));
    }
  }
  return result;
}

template <int M>
void EkfSolver<M>::save(field_core::State& state) const {
  save_node_indices(*this, state);
  state.set("mean", mean_.head(size_));
  state.set("covariance", covariance_.topLeftCorner(size_, size_));
  state.set("cell", Eigen::Vector2d(last_cell_.x, last_cell_.y));
}

template <int M>
void EkfSolver<M>::restore(const field_core::State& state) {
  const std::vector<GridIndex> indices = load_node_indices(state);
  const int size = first(static_cast<int>(indices.size()));
  const Eigen::MatrixXd &mean = state.matrix("mean", size, 1),
                        &covariance = state.matrix("covariance", size, size),
                        &cell = state.matrix("cell", 2, 1);
  table_.clear();
  for (GridIndex i : indices) table_.insert(i);
  size_ = size;
  reserve(size);
  mean_.head(size) = mean;
  covariance_.topLeftCorner(size, size) = covariance;
  last_cell_ = {static_cast<std::int16_t>(cell(0)), static_cast<std::int16_t>(cell(1))};
}

template class EkfSolver<1>;
template class EkfSolver<2>;
template class EkfSolver<3>;
template class EkfSolver<4>;
template class EkfSolver<5>;
template class EkfSolver<6>;
template class EkfSolver<7>;
template class EkfSolver<8>;

}  // namespace vector_field_slam
