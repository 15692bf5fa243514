#include "vector_field_slam/start.hpp"

#include <algorithm>
#include <cmath>

#include "field_core/errors.hpp"

namespace vector_field_slam {

using field_core::SE2;

Start::Start(const VectorFieldSlamParams& params, const std::vector<ChannelModel>& channels,
             const GridGeometry<double>& grid)
    : channels_(channels),
      grid_(grid),
      wanted_(params.start_measurements),
      calibration_variance_(params.calibration_stddev * params.calibration_stddev),
      pose_(params.initial_pose()),
      covariance_(
          Eigen::Vector3d(params.initial_cov_xx, params.initial_cov_yy, params.initial_cov_aa)
              .cwiseMax(field_core::kMinimumPoseVariance)
              .asDiagonal()),
      samples_(channels.size()) {}

RobotVector Start::robot() const {
  RobotVector r;
  r << pose_.vector(), 0.0, 0.0;
  return r;
}

void Start::move(const OdometryStep<double>& step) {
  pose_ = SE2(pose_.x() + step.dx, pose_.y() + step.dy, pose_.yaw() + step.dyaw);
  Eigen::Matrix3d g = Eigen::Matrix3d::Identity();
  g(0, 2) = -step.dy;
  g(1, 2) = step.dx;
  covariance_ = g * covariance_ * g.transpose() +
                Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(step.noise[0]);
}

void Start::set_pose(const SE2& pose, const Eigen::Matrix3d& covariance) {
  pose_ = pose;
  covariance_ = covariance;
  measurements_ = 0;  // seen from elsewhere
  for (auto& samples : samples_) samples.clear();
}

bool Start::add(const Mounting<double>& mounting, const Observation<double>* observations,
                int count) {
  // The roles of the channels do not depend on their number: field_value needs one at a time.
  const RobotVector robot = this->robot();
  const SensorPose<double> sensor(robot.data(), mounting);
  const double x = sensor.x - grid_.origin_x, y = sensor.y - grid_.origin_y;
  for (int k = 0; k < count; ++k) {
    const Observation<double>& z = observations[k];
    const Channel role = channels_[z.channel].role;
    const auto* partner = std::find_if(observations, observations + count, [&](const auto& other) {
      return other.channel == role.partner;
    });
    const bool found = partner != observations + count;
    if (role.partner >= 0 && !found) continue;
    SensorModel<double, 1> one;
    one.channels[0] = role;
    const double value = one.field_value(0, sensor, robot.data() + kPose, x, y, z.value,
                                         found ? partner->value : 0.0);
    samples_[z.channel].push_back({x, y, value, std::sqrt(z.variance)});
  }
  return ++measurements_ >= wanted_;
}

std::vector<bool> Start::seen() const {
  std::vector<bool> seen;
  for (const auto& samples : samples_) seen.push_back(!samples.empty());
  return seen;
}

StartState Start::state(GridIndex cell) const {
  StartState s;
  s.robot = robot();
  s.covariance.setZero();
  s.covariance.topLeftCorner<kPose, kPose>() = covariance_;
  s.covariance.diagonal().tail<kRobot - kPose>().setConstant(calibration_variance_);
  s.cell = cell;
  s.node_values.setZero(static_cast<Eigen::Index>(channels_.size()), 4);
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    if (samples_[i].empty()) continue;
    const double slope_stddev = std::sqrt(channels_[i].prior_variance) / grid_.cell_size;
    const auto field = LinearStart<double>::fit(samples_[i].data(),
                                                static_cast<int>(samples_[i].size()), slope_stddev);
    for (int j = 0; j < 4; ++j) {
      const GridIndex node = cell_node(cell, j);
      s.node_values(static_cast<Eigen::Index>(i), j) =
          field.at(grid_.node_x(node) - grid_.origin_x, grid_.node_y(node) - grid_.origin_y);
    }
  }
  return s;
}

void Start::save(field_core::State& state) const {
  state.set("start_pose", pose_.vector());
  state.set("start_covariance", covariance_);
  state.set("start_measurements", measurements_);
  std::size_t count = 0;
  for (const auto& samples : samples_) count += samples.size();
  Eigen::MatrixXd all(5, count);
  Eigen::Index column = 0;
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    for (const auto& f : samples_[i]) {
      all.col(column++) << static_cast<double>(i), f.x, f.y, f.value, f.stddev;
    }
  }
  state.set("start_samples", all);
}

void Start::restore(const field_core::State& state) {
  const Eigen::MatrixXd &pose = state.matrix("start_pose", 3, 1),
                        &covariance = state.matrix("start_covariance", 3, 3),
                        &all = state.matrix("start_samples", 5, -1);
  std::vector<std::vector<FieldSample<double>>> samples(channels_.size());
  for (Eigen::Index k = 0; k < all.cols(); ++k) {
    if (!(all(0, k) >= 0.0 && all(0, k) < static_cast<double>(samples.size()))) {
      throw field_core::DataError("state block 'start_samples' names channel " +
                                  std::to_string(all(0, k)) + ", which is not configured");
    }
    samples[static_cast<std::size_t>(all(0, k))].push_back(
        {all(1, k), all(2, k), all(3, k), all(4, k)});
  }
  measurements_ = static_cast<int>(state.scalar("start_measurements"));
  pose_ = SE2(Eigen::Vector3d(pose));
  covariance_ = covariance;
  samples_ = std::move(samples);
}

}  // namespace vector_field_slam
