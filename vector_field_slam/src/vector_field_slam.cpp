#include "vector_field_slam/vector_field_slam.hpp"

#include <algorithm>
#include <cmath>

#include "field_core/errors.hpp"

namespace vector_field_slam {

using field_core::SE2;
using field_core::UpdateResult;

VectorFieldSlam::VectorFieldSlam(const Params& params, std::uint64_t)
    : params_(params),
      channels_(make_channels(params)),
      infos_(field_infos(params)),
      grid_(GridGeometry<double>::around(params.initial_pose_x, params.initial_pose_y,
                                         params.cell_size)),
      motion_model_(params.odometry_noise),
      start_(params, channels_, grid_),
      solver_(make_solver(params, channels_)) {
  observations_.reserve(channels_.size());
}

void VectorFieldSlam::reset() {
  start_ = Start(params_, channels_, grid_);
  solver_ = make_solver(params_, channels_);
  started_ = updated_ = false;
  stamp_ = field_core::Stamp(0);
  moved_distance_ = moved_angle_ = 0.0;
}

void VectorFieldSlam::predict(const field_core::OdometryIncrement& increment) {
  const double distance = std::hypot(increment.delta.x(), increment.delta.y());
  const auto step = odometry_step(motion_model_, belief().mean, increment.delta);
  if (started_) {
    solver_->move(step, params_.calibration_noise * params_.calibration_noise * distance);
  } else {
    start_.move(step);
  }
  moved_distance_ += distance;
  moved_angle_ += std::abs(increment.delta.yaw());
  stamp_ = increment.to;
}

bool VectorFieldSlam::moved_enough() const {
  const bool gated = params_.update_min_d > 0.0 || params_.update_min_a > 0.0;
  if (!gated || !updated_) return true;
  return (params_.update_min_d > 0.0 && moved_distance_ >= params_.update_min_d) ||
         (params_.update_min_a > 0.0 && moved_angle_ >= params_.update_min_a);
}

void VectorFieldSlam::collect_observations(const field_core::Sample& sample) {
  observations_.clear();
  for (const field_core::Reading& reading : sample.readings) {
    if (reading.field < 0 || reading.field >= static_cast<int>(channels_.size())) continue;
    const ChannelModel& channel = channels_[reading.field];
    const double noise = reading.variance > 0.0 ? reading.variance : channel.noise_variance;
    observations_.push_back({reading.field, reading.value, noise + channel.interpolation_variance});
  }
}

UpdateResult VectorFieldSlam::update(const field_core::Sample& sample) {
  collect_observations(sample);
  if (observations_.empty()) return UpdateResult::skipped("no known channel");
  if (!moved_enough()) return UpdateResult::skipped("not moved enough");
  const SE2& m = sample.sensor_in_base;
  const Mounting<double> mounting{m.x(), m.y(), m.yaw()};
  UpdateResult result;
  if (started_) {
    solver_->wait_for_background(wait_);
    solver_->stamp(sample.stamp);
    result =
        solver_->observe(mounting, observations_.data(), static_cast<int>(observations_.size()));
  } else {
    result = start_with(mounting);
  }
  updated_ = true;
  moved_distance_ = moved_angle_ = 0.0;
  stamp_ = sample.stamp;
  return result;
}

UpdateResult VectorFieldSlam::start_with(const Mounting<double>& mounting) {
  if (start_.add(mounting, observations_.data(), static_cast<int>(observations_.size()))) {
    const SE2 sensor = start_.pose() * SE2(mounting.x, mounting.y, mounting.yaw);
    GridIndex cell;
    if (!grid_.cell_of(sensor.x(), sensor.y(), cell)) {
      return UpdateResult::skipped("the sensor's place is off the grid");
    }
    solver_->start(start_.state(cell));
    started_ = true;
  }
  return UpdateResult::skipped("first measurements");
}

field_core::Belief VectorFieldSlam::belief() const {
  if (!started_) return {stamp_, start_.pose(), start_.covariance(), {}};
  const RobotVector robot = solver_->robot();
  return {stamp_,
          SE2(robot[0], robot[1], robot[2]),
          solver_->robot_covariance().topLeftCorner<kPose, kPose>(),
          {}};
}

void VectorFieldSlam::set_pose(const SE2& mean, const Eigen::Matrix3d& covariance) {
  const Eigen::Matrix3d floored =
      covariance + field_core::kMinimumPoseVariance * Eigen::Matrix3d::Identity();
  if (started_) {
    solver_->set_pose(mean, floored);
  } else {
    start_.set_pose(mean, floored);
  }
}

void VectorFieldSlam::scatter() {}

field_core::MapRegion VectorFieldSlam::map_region() const {
  GridIndex low, high{1, 1};  // the first cell
  for (int i = 0; started_ && i < solver_->node_count(); ++i) {
    const GridIndex n = solver_->node_index(i);
    low = {std::min(low.x, n.x), std::min(low.y, n.y)};
    high = {std::max(high.x, n.x), std::max(high.y, n.y)};
  }
  return {grid_.node_x(low), grid_.node_y(low), grid_.node_x(high), grid_.node_y(high)};
}

field_core::State VectorFieldSlam::state() const {
  field_core::State state(kName, kStateVersion);
  state.set_text("stamp_ns", std::to_string(stamp_.count()));
  state.set("channels", static_cast<double>(channels_.size()));
  state.set("started", started_ ? 1.0 : 0.0);
  state.set("updated", updated_ ? 1.0 : 0.0);
  state.set("moved", Eigen::Vector2d(moved_distance_, moved_angle_));
  state.set("grid", Eigen::Vector3d(grid_.cell_size, grid_.origin_x, grid_.origin_y));
  start_.save(state);
  if (started_) solver_->save(state);
  return state;
}

void VectorFieldSlam::restore(const field_core::State& state) {
  state.require(kName, kStateVersion);
  if (state.scalar("channels") != static_cast<double>(channels_.size())) {
    throw field_core::DataError("the state has " + std::to_string(state.scalar("channels")) +
                                " channels, the configuration " + std::to_string(channels_.size()));
  }
  const Eigen::MatrixXd &moved = state.matrix("moved", 2, 1), &grid = state.matrix("grid", 3, 1);
  if (grid(0) != grid_.cell_size || grid(1) != grid_.origin_x || grid(2) != grid_.origin_y) {
    throw field_core::DataError(
        "the state has another grid; cell_size and initial_pose_x, initial_pose_y must be those it "
        "was saved with");
  }
  const bool started = state.scalar("started") != 0.0, updated = state.scalar("updated") != 0.0;
  const auto stamp = field_core::Stamp(std::stoll(state.text("stamp_ns")));
  Start start = start_;
  start.restore(state);
  if (started) {
    auto solver = make_solver(params_, channels_);
    solver->restore(state);
    solver_ = std::move(solver);
  }
  start_ = start;
  started_ = started;
  updated_ = updated;
  stamp_ = stamp;
  moved_distance_ = moved(0);
  moved_angle_ = moved(1);
}

}  // namespace vector_field_slam
