#include "vector_field_slam/localize_solver.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

#include "field_core/errors.hpp"
#include "solver_common.hpp"

namespace vector_field_slam {

AnySensor any_sensor(const std::vector<ChannelModel>& channels) {
  AnySensor sensor;
  for (std::size_t i = 0; i < channels.size(); ++i) sensor.channels[i] = channels[i].role;
  return sensor;
}

LocalizeSolver::LocalizeSolver(std::unique_ptr<Solver> map,
                               const std::vector<ChannelModel>& channels,
                               const GridGeometry<double>& grid, double gate)
    : map_(std::move(map)),
      sensor_(any_sensor(channels)),
      channels_(static_cast<int>(channels.size())),
      grid_(grid),
      gate_(gate) {}

void LocalizeSolver::start(const StartState&) {
  throw field_core::DataError("localize_only: true needs a map; load a state first");
}

void LocalizeSolver::move(const OdometryStep<double>& step, double calibration_variance) {
  mean_[0] += step.dx;
  mean_[1] += step.dy;
  mean_[2] = field_core::wrap_angle(mean_[2] + step.dyaw);
  RobotMatrix g = RobotMatrix::Identity();
  g(0, 2) = -step.dy;
  g(1, 2) = step.dx;
  covariance_ = (g * covariance_ * g.transpose()).eval();
  cross_ = (g * cross_).eval();
  for (int i = 0; i < kPose; ++i) {
    for (int j = 0; j < kPose; ++j) covariance_(i, j) += step.noise[i][j];
  }
  covariance_(3, 3) += calibration_variance;
  covariance_(4, 4) += calibration_variance;
}

bool LocalizeSolver::enter(GridIndex cell) {
  if (!nodes_.empty() && cell == cell_) return true;
  std::vector<int> nodes;
  for (int j = 0; j < 4; ++j) nodes.push_back(find(cell_node(cell, j)));
  if (*std::min_element(nodes.begin(), nodes.end()) < 0) return false;
  if (nodes_.empty()) {
    cross_.setZero(kRobot, 4 * channels_);
    node_covariance_ = map_->node_covariance(nodes);
  } else {
    carry_over(nodes);
  }
  nodes_ = nodes;
  cell_ = cell;
  return true;
}

void LocalizeSolver::carry_over(const std::vector<int>& nodes) {
  std::vector<int> all = nodes_;  // first the old
  std::vector<Eigen::Index> place;
  for (const int node : nodes) {
    const auto known = std::find(all.begin(), all.end(), node);
    place.push_back(known - all.begin());
    if (known == all.end()) all.push_back(node);
  }
  const Eigen::MatrixXd joint = map_->node_covariance(all);
  const Eigen::Index width = 4 * channels_;
  const Eigen::MatrixXd old = joint.topLeftCorner(width, width);
  Eigen::MatrixXd both(width, width), fresh(width, width);  // old with new, new with new
  for (int i = 0; i < 4; ++i) {
    both.middleCols(i * channels_, channels_) =
        joint.block(0, place[i] * channels_, width, channels_);
    for (int j = 0; j < 4; ++j) {
      fresh.block(j * channels_, i * channels_, channels_, channels_) =
          joint.block(place[j] * channels_, place[i] * channels_, channels_, channels_);
    }
  }
  const Eigen::LLT<Eigen::MatrixXd> factor(old);
  if (factor.info() != Eigen::Success) throw_not_positive();
  const Eigen::MatrixXd regression = factor.solve(both);
  cross_ = (cross_ * regression).eval();
  // An ESEIF gives a covariance that depends on which nodes it is asked for: what it says here of
  // the old ones must not contradict what is in use, or the covariance of all is not positive.
  node_covariance_ =
      (fresh + regression.transpose() * (node_covariance_ - old) * regression).eval();
}

/// One row per reading: how it depends on the robot and on the nodes, what it says and its noise.
struct LocalizeSolver::Rows {
  Eigen::Matrix<double, Eigen::Dynamic, kRobot, 0, kMostChannels> robot{kMostChannels, kRobot};
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostChannels, 4 * kMostChannels> nodes;
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostChannels> innovation{kMostChannels},
      noise{kMostChannels};
  int count = 0;
};

LocalizeSolver::Rows LocalizeSolver::linearize(const SensorPose<double>& sensor,
                                               const Observation<double>* observations,
                                               int count) const {
  const Interpolation<double> at(grid_, cell_, sensor.x, sensor.y);
  const double* values[4];
  for (int j = 0; j < 4; ++j) values[j] = node_values(nodes_[j]);
  Rows rows;
  rows.nodes.setZero(kMostChannels, 4 * channels_);
  for (int k = 0; k < count; ++k) {
    const int channel = observations[k].channel, i = rows.count;
    const auto p = sensor_.predict(channel, sensor, mean_.data() + kPose, at, values);
    rows.robot.row(i) = Eigen::Map<const Eigen::Matrix<double, 1, kRobot>>(p.robot);
    rows.nodes.row(i).setZero();
    for (int j = 0; j < 4; ++j) {
      rows.nodes(i, j * channels_ + channel) = at.w[j] * p.own;
      if (p.partner >= 0) rows.nodes(i, j * channels_ + p.partner) = at.w[j] * p.other;
    }
    rows.innovation[i] = observations[k].value - p.value;
    rows.noise[i] = observations[k].variance;
    const auto h = rows.robot.row(i);
    const auto n = rows.nodes.row(i);
    const double total = rows.noise[i] + (h * covariance_ * h.transpose()).value() +
                         2.0 * (h * cross_ * n.transpose()).value() +
                         (n * node_covariance_ * n.transpose()).value();
    if (gate_ > 0.0 && rows.innovation[i] * rows.innovation[i] > gate_ * total) continue;
    ++rows.count;
  }
  return rows;
}

field_core::UpdateResult LocalizeSolver::observe(const Mounting<double>& mounting,
                                                 const Observation<double>* observations,
                                                 int count) {
  const SensorPose<double> sensor(mean_.data(), mounting);
  GridIndex cell;
  if (!grid_.cell_of(sensor.x, sensor.y, cell)) {
    return field_core::UpdateResult::skipped(kNoPlace);
  }
  if (!enter(cell)) return field_core::UpdateResult::skipped(kUnknownCell);
  const Rows rows = linearize(sensor, observations, count);
  if (rows.count == 0) return field_core::UpdateResult::skipped(kGated);

  const auto h = rows.robot.topRows(rows.count);
  const auto n = rows.nodes.topRows(rows.count);
  const auto innovation = rows.innovation.head(rows.count);
  using Square =
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostChannels, kMostChannels>;
  using Gain = Eigen::Matrix<double, kRobot, Eigen::Dynamic, 0, kRobot, kMostChannels>;
  Square q = n * node_covariance_ * n.transpose();
  q.diagonal() += rows.noise.head(rows.count);
  const Gain xn = cross_ * n.transpose();
  const Square both = h * xn;
  const Square s = h * covariance_ * h.transpose() + both + both.transpose() + q;
  const Eigen::LLT<Square> factor(s);
  if (factor.info() != Eigen::Success) throw_not_positive();
  const Gain with = covariance_ * h.transpose() + xn;
  const Gain gain = factor.solve(with.transpose()).transpose();
  const double nis = innovation.dot(factor.solve(innovation));
  mean_ += gain * innovation;
  mean_[2] = field_core::wrap_angle(mean_[2]);
  // Joseph's form of both stays positive.
  const RobotMatrix a = RobotMatrix::Identity() - gain * h;
  const RobotMatrix mixed = a * xn * gain.transpose();
  covariance_ =
      (a * covariance_ * a.transpose() - mixed - mixed.transpose() + gain * q * gain.transpose())
          .eval();
  covariance_ = (0.5 * (covariance_ + covariance_.transpose())).eval();
  cross_ = (a * cross_ - gain * n * node_covariance_).eval();
  return {true, "", nis, rows.count};
}

void LocalizeSolver::set_pose(const field_core::SE2& pose, const Eigen::Matrix3d& covariance) {
  mean_.head<kPose>() = pose.vector();
  covariance_.topRows<kPose>().setZero();
  covariance_.leftCols<kPose>().setZero();
  covariance_.topLeftCorner<kPose, kPose>() = covariance;
  cross_.topRows<kPose>().setZero();
}

void LocalizeSolver::save(field_core::State& state) const {
  map_->save(state);
  state.set("localized_mean", mean_);
  state.set("localized_covariance", covariance_);
  if (nodes_.empty()) return;
  state.set("localized_cell", Eigen::Vector2d(cell_.x, cell_.y));
  state.set("localized_cross", cross_);
  state.set("localized_nodes", node_covariance_);
}

void LocalizeSolver::restore(const field_core::State& state) {
  RobotVector mean;
  RobotMatrix covariance;
  const bool own = state.numbers().count("localized_mean") > 0;
  const bool within = own && state.numbers().count("localized_cell") > 0;
  if (own) {
    mean = state.matrix("localized_mean", kRobot, 1);
    covariance = state.matrix("localized_covariance", kRobot, kRobot);
  }
  const Eigen::Index width = 4 * channels_;
  CrossMatrix cross;
  NodeMatrix nodes;
  GridIndex cell;
  if (within) {
    cross = state.matrix("localized_cross", kRobot, width);
    nodes = state.matrix("localized_nodes", width, width);
    const Eigen::MatrixXd& at = state.matrix("localized_cell", 2, 1);
    cell = {static_cast<std::int16_t>(at(0)), static_cast<std::int16_t>(at(1))};
  }
  map_->restore(state);
  mean_ = own ? mean : map_->robot();
  covariance_ = own ? covariance : map_->robot_covariance();
  nodes_.clear();
  cross_.resize(kRobot, 0);
  if (!within || !enter(cell)) return;
  cross_ = cross;
  node_covariance_ = nodes;
}

}  // namespace vector_field_slam
