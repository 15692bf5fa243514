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
  node_covariance_ = map_->node_covariance(nodes);
  nodes_ = nodes;
  cell_ = cell;
  return true;
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
  const Interpolation<double> at(grid_, cell, sensor.x, sensor.y);
  const double* values[4];
  for (int j = 0; j < 4; ++j) values[j] = node_values(nodes_[j]);

  Eigen::Matrix<double, kMostChannels, kRobot> h;
  Eigen::Matrix<double, kMostChannels, 4 * kMostChannels> n;
  Eigen::Matrix<double, kMostChannels, 1> innovation, variance;
  const Eigen::Index width = 4 * channels_;
  int used = 0;
  for (int k = 0; k < count; ++k) {
    const int channel = observations[k].channel;
    const auto p = sensor_.predict(channel, sensor, mean_.data() + kPose, at, values);
    h.row(used) = Eigen::Map<const Eigen::Matrix<double, 1, kRobot>>(p.robot);
    n.row(used).setZero();
    for (int j = 0; j < 4; ++j) {
      n(used, j * channels_ + channel) = at.w[j] * p.own;
      if (p.partner >= 0) n(used, j * channels_ + p.partner) = at.w[j] * p.other;
    }
    innovation[used] = observations[k].value - p.value;
    variance[used] = observations[k].variance;
    const double total =
        variance[used] + h.row(used) * covariance_ * h.row(used).transpose() +
        n.row(used).head(width) * node_covariance_ * n.row(used).head(width).transpose();
    if (gate_ > 0.0 && innovation[used] * innovation[used] > gate_ * total) continue;
    ++used;
  }
  if (used == 0) return field_core::UpdateResult::skipped(kGated);

  const auto hu = h.topRows(used);
  const auto nu = n.topLeftCorner(used, width);
  using Square =
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostChannels, kMostChannels>;
  Square q = nu * node_covariance_ * nu.transpose();
  q.diagonal() += variance.head(used);
  const Square s = hu * covariance_ * hu.transpose() + q;
  const Eigen::LLT<Square> factor(s);
  if (factor.info() != Eigen::Success) throw_not_positive();
  const Eigen::Matrix<double, kRobot, Eigen::Dynamic, 0, kRobot, kMostChannels> gain =
      factor.solve(hu * covariance_).transpose();
  const double nis = innovation.head(used).dot(factor.solve(innovation.head(used)));
  mean_ += gain * innovation.head(used);
  mean_[2] = field_core::wrap_angle(mean_[2]);
  const RobotMatrix a = RobotMatrix::Identity() - gain * hu;  // Joseph's form stays positive
  covariance_ = (a * covariance_ * a.transpose() + gain * q * gain.transpose()).eval();
  covariance_ = (0.5 * (covariance_ + covariance_.transpose())).eval();
  return {true, "", nis, used};
}

void LocalizeSolver::set_pose(const field_core::SE2& pose, const Eigen::Matrix3d& covariance) {
  mean_.head<kPose>() = pose.vector();
  covariance_.topRows<kPose>().setZero();
  covariance_.leftCols<kPose>().setZero();
  covariance_.topLeftCorner<kPose, kPose>() = covariance;
}

void LocalizeSolver::save(field_core::State& state) const {
  map_->save(state);
  state.set("localized_mean", mean_);
  state.set("localized_covariance", covariance_);
}

void LocalizeSolver::restore(const field_core::State& state) {
  RobotVector mean;
  RobotMatrix covariance;
  const bool own = state.numbers().count("localized_mean") > 0;
  if (own) {
    mean = state.matrix("localized_mean", kRobot, 1);
    covariance = state.matrix("localized_covariance", kRobot, kRobot);
  }
  map_->restore(state);
  mean_ = own ? mean : map_->robot();
  covariance_ = own ? covariance : map_->robot_covariance();
  nodes_.clear();
}

}  // namespace vector_field_slam
