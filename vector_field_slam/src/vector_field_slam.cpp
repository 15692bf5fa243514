#include "vector_field_slam/vector_field_slam.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "field_core/errors.hpp"
#include "solver_common.hpp"

namespace vector_field_slam {

using field_core::SE2;
using field_core::UpdateResult;

namespace {

constexpr const char* kJump = "odometry jumped and was not believed (max_speed, max_turn_rate)";

/// Stamps are often coarse: a step counts as 50 ms at least.
double step_seconds(const field_core::OdometryIncrement& increment) {
  return std::max(field_core::to_seconds(increment.to - increment.from), 0.05);
}

}  // namespace

VectorFieldSlam::VectorFieldSlam(const Params& params, std::uint64_t seed)
    : params_(params),
      channels_(make_channels(params)),
      infos_(field_infos(params)),
      grid_(GridGeometry<double>::around(params.initial_pose_x, params.initial_pose_y,
                                         params.cell_size)),
      motion_model_(params.odometry_noise),
      seed_(seed),
      random_(seed),
      start_(params, channels_, grid_),
      solver_(make_solver(params, channels_)),
      relocalization_(channels_, grid_, motion_model_, params.relocalization_particles),
      seen_(channels_.size(), false) {
  observations_.reserve(channels_.size());
}

std::vector<std::string> VectorFieldSlam::run_parameters() {
  return {"start_measurements", "gate_probability", "calibration_noise",
          "localize_only",      "patience",         "relocalization_particles",
          "max_nodes",          "odom_alpha1",      "odom_alpha2",
          "max_speed",          "max_turn_rate",    "odom_alpha3",
          "odom_alpha4",        "initial_pose_a",   "initial_cov_xx",
          "initial_cov_yy",     "initial_cov_aa",   "update_min_d",
          "update_min_a"};
}

void VectorFieldSlam::reset() {
  random_ = field_core::Random(seed_);
  start_ = Start(params_, channels_, grid_);
  solver_ = make_solver(params_, channels_);
  relocalization_.stop();
  started_ = updated_ = false;
  seen_.assign(channels_.size(), false);
  rejected_ = 0;
  note_ = "";
  stamp_ = field_core::Stamp(0);
  moved_distance_ = moved_angle_ = 0.0;
}

OdometryStep<double> VectorFieldSlam::step_of(const field_core::OdometryIncrement& increment,
                                              const SE2& pose) const {
  if (believable(increment)) return odometry_step(motion_model_, pose, increment.delta);
  const double seconds = step_seconds(increment);
  const double reach = params_.max_speed * seconds, turn = params_.max_turn_rate * seconds;
  // Even over a disc of that radius, and over that angle, as far as a Gaussian can say it.
  const double yaw = std::min(turn, M_PI) / 1.7;
  return {
      0.0,
      0.0,
      0.0,
      {{reach * reach / 4.0, 0.0, 0.0}, {0.0, reach * reach / 4.0, 0.0}, {0.0, 0.0, yaw * yaw}}};
}

bool VectorFieldSlam::believable(const field_core::OdometryIncrement& increment) const {
  const double seconds = step_seconds(increment);
  const SE2& d = increment.delta;
  return std::hypot(d.x(), d.y()) <= params_.max_speed * seconds &&
         std::abs(d.yaw()) <= params_.max_turn_rate * seconds;
}

void VectorFieldSlam::predict(const field_core::OdometryIncrement& increment) {
  if (!believable(increment)) note_ = kJump;
  const double distance = std::hypot(increment.delta.x(), increment.delta.y());
  if (started_) {
    const RobotVector r = solver_->robot();
    solver_->move(step_of(increment, SE2(r[0], r[1], r[2])),
                  params_.calibration_noise * params_.calibration_noise * distance);
    if (relocalization_.active()) relocalization_.move(increment.delta, random_);
  } else {
    start_.move(step_of(increment, start_.pose()));
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
    observations_.push_back(as_observation(reading.field, channel.role.kind, reading.value,
                                           noise + channel.interpolation_variance));
  }
}

UpdateResult VectorFieldSlam::update(const field_core::Sample& sample) {
  collect_observations(sample);
  if (observations_.empty()) return UpdateResult::skipped("no known channel");
  if (!moved_enough()) return UpdateResult::skipped("not moved enough");
  const SE2& m = sample.sensor_in_base;
  const Mounting<double> mounting{m.x(), m.y(), m.yaw()};
  UpdateResult result;
  if (!started_) {
    result = params_.localize_only ? UpdateResult::skipped("no map loaded") : start_with(mounting);
  } else if (relocalization_.active()) {
    result = search(mounting);
  } else {
    start_late_channels(mounting);
    solver_->wait_for_background(wait_);
    solver_->stamp(sample.stamp);
    result =
        solver_->observe(mounting, observations_.data(), static_cast<int>(observations_.size()));
    if (result.applied) {
      rejected_ = 0;
    } else if (result.reason == std::string_view(kGated) || astray()) {
      ++rejected_;
    }
    if (result.applied && *note_) result.reason = std::exchange(note_, "");
    if (rejected_ >= params_.patience) give_up();
  }
  updated_ = true;
  moved_distance_ = moved_angle_ = 0.0;
  stamp_ = sample.stamp;
  return result;
}

/// Where there is no map, nothing contradicts the pose and odometry has to do; until it no longer
/// tells which cell the robot is in (two standard deviations are a cell).
bool VectorFieldSlam::astray() const {
  const Eigen::Matrix2d position = solver_->robot_covariance().topLeftCorner<2, 2>();
  const double cell = params_.cell_size;
  return 4.0 * position.selfadjointView<Eigen::Lower>().eigenvalues().maxCoeff() > cell * cell;
}

UpdateResult VectorFieldSlam::search(const Mounting<double>& mounting) {
  const auto found = relocalization_.observe(*solver_, mounting, observations_.data(),
                                             static_cast<int>(observations_.size()), random_);
  if (found) {
    set_pose(found->mean, found->covariance);
  }
  return UpdateResult::skipped("searching the map");
}

/// A channel that first speaks up late: the whole map takes the value that its first reading has
/// here, with the spread of ignorance.
void VectorFieldSlam::start_late_channels(const Mounting<double>& mounting) {
  const RobotVector robot = solver_->robot();
  const SensorPose<double> sensor(robot.data(), mounting);
  for (const auto& z : observations_) {
    if (seen_[z.channel]) continue;
    const Channel role = channels_[z.channel].role;
    const auto partner = std::find_if(observations_.begin(), observations_.end(),
                                      [&](const auto& o) { return o.channel == role.partner; });
    if (role.partner >= 0 && partner == observations_.end()) continue;
    SensorModel<double, 1> one;
    one.channels[0] = role;
    const double value = one.field_value(0, sensor, robot.data() + kPose, sensor.x - grid_.origin_x,
                                         sensor.y - grid_.origin_y, z.value,
                                         role.partner >= 0 ? partner->value : 0.0);
    solver_->start_channel(z.channel, value);
    seen_[z.channel] = true;
  }
}

/// Nothing has fitted for a while. On a known map the robot is searched for; while the map is made,
/// a wrong answer would spoil it: there the pose may only be anywhere around, by a tenth of a cell
/// and 3 degrees more with each measurement that does not fit.
void VectorFieldSlam::give_up() {
  if (params_.localize_only) return scatter();
  const double position = 0.1 * params_.cell_size, yaw = 0.05;
  OdometryStep<double> nowhere{0.0, 0.0, 0.0, {}};
  nowhere.noise[0][0] = nowhere.noise[1][1] = position * position;
  nowhere.noise[2][2] = yaw * yaw;
  solver_->move(nowhere, 0.0);
}

UpdateResult VectorFieldSlam::start_with(const Mounting<double>& mounting) {
  if (start_.add(mounting, observations_.data(), static_cast<int>(observations_.size()))) {
    const SE2 sensor = start_.pose() * SE2(mounting.x, mounting.y, mounting.yaw);
    GridIndex cell;
    if (!grid_.cell_of(sensor.x(), sensor.y(), cell)) {
      return UpdateResult::skipped("the sensor's place is off the grid");
    }
    solver_->start(start_.state(cell));
    seen_ = start_.seen();
    started_ = true;
  }
  return UpdateResult::skipped("first measurements");
}

field_core::Belief VectorFieldSlam::belief() const {
  // Rounding leaves a product G P G^T symmetric to the last bit but one.
  const auto symmetric = [](const Eigen::Matrix3d& c) -> Eigen::Matrix3d {
    return 0.5 * (c + c.transpose());
  };
  if (!started_) return {stamp_, start_.pose(), symmetric(start_.covariance()), {}};
  if (relocalization_.active()) return relocalization_.belief(stamp_);
  const RobotVector robot = solver_->robot();
  return {stamp_,
          SE2(robot[0], robot[1], robot[2]),
          symmetric(solver_->robot_covariance().topLeftCorner<kPose, kPose>()),
          {}};
}

void VectorFieldSlam::set_pose(const SE2& mean, const Eigen::Matrix3d& covariance) {
  relocalization_.stop();
  rejected_ = 0;
  const Eigen::Matrix3d floored =
      covariance + field_core::kMinimumPoseVariance * Eigen::Matrix3d::Identity();
  if (started_) {
    solver_->set_pose(mean, floored);
  } else {
    start_.set_pose(mean, floored);
  }
}

void VectorFieldSlam::scatter() {
  rejected_ = 0;
  if (started_) relocalization_.scatter(*solver_, random_);
}

field_core::Health VectorFieldSlam::health() const {
  if (relocalization_.active()) return {true, "searching the map"};
  if (rejected_ >= params_.patience) return {true, "measurements outside the gate"};
  return {};
}

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
  state.set_text("random", random_.state());
  state.set("rejected", rejected_);
  state.set("jumped", *note_ ? 1.0 : 0.0);
  Eigen::VectorXd seen(seen_.size());
  for (std::size_t i = 0; i < seen_.size(); ++i) seen[i] = seen_[i] ? 1.0 : 0.0;
  state.set("seen", seen);
  start_.save(state);
  relocalization_.save(state);
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
  const Eigen::MatrixXd& seen =
      state.matrix("seen", static_cast<Eigen::Index>(channels_.size()), 1);
  const int rejected = static_cast<int>(state.scalar("rejected"));
  const bool jumped = state.scalar("jumped") != 0.0;
  field_core::Random random(seed_);
  random.restore(state.text("random"));
  Start start = start_;
  start.restore(state);
  Relocalization relocalization = relocalization_;
  relocalization.restore(state);
  auto solver = make_solver(params_, channels_);
  if (started) solver->restore(state);  // the last that can fail
  solver_ = std::move(solver);
  start_ = start;
  relocalization_ = relocalization;
  random_ = random;
  for (std::size_t i = 0; i < seen_.size(); ++i) seen_[i] = seen(static_cast<Eigen::Index>(i)) != 0;
  rejected_ = rejected;
  note_ = jumped ? kJump : "";
  started_ = started;
  updated_ = updated;
  stamp_ = stamp;
  moved_distance_ = moved(0);
  moved_angle_ = moved(1);
}

}  // namespace vector_field_slam
