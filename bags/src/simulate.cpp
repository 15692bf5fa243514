#include "field_bags/simulate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "field_core/csv.hpp"
#include "field_core/errors.hpp"

namespace field_bags {
namespace {

using field_core::Random;
using field_core::SE2;
using field_core::Stamp;

constexpr Stamp kStart = std::chrono::seconds(1000);
constexpr double kPoseStep = 1e6, kReadingStep = 1e4;  // 1 / rounding unit

double rounded(double value, double steps) { return std::round(value * steps) / steps; }

SE2 rounded(const SE2& pose) {
  return SE2(rounded(pose.x(), kPoseStep), rounded(pose.y(), kPoseStep),
             rounded(pose.yaw(), kPoseStep));
}

/// Seconds after the start of the k-th tick, on whole nanoseconds.
Stamp tick(std::size_t k, double rate) {
  return Stamp(std::llround(static_cast<double>(k) * 1e9 / rate));
}

std::size_t ticks(double duration, double rate) {
  return static_cast<std::size_t>(std::floor(duration * rate + 1e-9)) + 1;
}

/// One reading of one channel; NaN if it is dropped or too weak. Always the same number of draws.
double read_channel(const Channel& channel, double value, const SensorParams& sensor,
                    Random& random) {
  const double noise = random.normal();
  const bool dropped = random.uniform() < sensor.dropout_probability;
  const bool outlier = random.uniform() < sensor.outlier_probability;
  const double gross = random.normal();
  double reading = value + channel.noise_stddev * noise;
  if (outlier) reading += channel.noise_stddev * sensor.outlier_size * gross;
  if (dropped || reading < channel.floor) return std::numeric_limits<double>::quiet_NaN();
  return rounded(reading, kReadingStep);
}

std::vector<double> read_all(const World& world, const SE2& sensor_pose, const SensorParams& sensor,
                             Random& random) {
  std::vector<double> values = world.values(sensor_pose);
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = read_channel(world.channels()[i], values[i], sensor, random);
  }
  return values;
}

bool any_observed(const std::vector<double>& values) {
  return std::any_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

/// When a robot is switched on: from its joining, where its drive begins.
struct Shift {
  Stamp start;
  double duration;  // [s]
};

Shift shift_of(const RobotParams& robot, double duration) {
  const double end = robot.leaves > 0.0 ? std::min(robot.leaves, duration) : duration;
  if (!(robot.joins < end)) {
    throw field_core::ParameterError("joins", "is not before the end of the run");
  }
  return {kStart + field_core::stamp_from_seconds(robot.joins), end - robot.joins};
}

void record_motion(const RobotParams& robot, const Shift& shift, const Drive& drive, Random& random,
                   Recording& recording) {
  SE2 odometry, before = drive.at(0.0);
  for (std::size_t k = 0; k < ticks(shift.duration, robot.odometry.rate); ++k) {
    const Stamp since = tick(k, robot.odometry.rate);
    const SE2 truth = drive.at(field_core::to_seconds(since));
    odometry = odometry * reported_motion(before.between(truth), robot.odometry, random);
    before = truth;
    recording.truth.push_back({shift.start + since, rounded(truth), std::nullopt});
    recording.odometry.push_back({shift.start + since, rounded(odometry), std::nullopt});
  }
}

void record_fields(const RobotParams& robot, const Shift& shift, const World& world,
                   const Drive& drive, Random& random, Recording& recording) {
  for (std::size_t k = 0; k < ticks(shift.duration, robot.sensor.rate); ++k) {
    const Stamp since = tick(k, robot.sensor.rate);
    const SE2 sensor = drive.at(field_core::to_seconds(since)) * recording.sensor_in_base;
    FieldRow row{shift.start + since, read_all(world, sensor, robot.sensor, random)};
    if (any_observed(row.values)) recording.measurements.push_back(std::move(row));
  }
}

void record_positions(const PositionParams& position, const Shift& shift, const Drive& drive,
                      Random& random, Recording& recording) {
  if (position.rate <= 0.0) return;
  for (std::size_t k = 0; k < ticks(shift.duration, position.rate); ++k) {
    const Stamp since = tick(k, position.rate);
    const Eigen::Vector2d truth = drive.at(field_core::to_seconds(since)).translation();
    const double x = random.normal(truth.x(), position.stddev);
    const double y = random.normal(truth.y(), position.stddev);
    recording.positions.push_back({shift.start + since,
                                   {rounded(x, kReadingStep), rounded(y, kReadingStep)},
                                   position.stddev * position.stddev});
  }
}

Recording record(const World& world, const WorldParams& params, const RobotParams& robot,
                 const std::string& name, std::uint64_t seed) {
  const auto stream = [&](const std::string& purpose) {
    return random_stream(seed, name.empty() ? purpose : purpose + "/" + name);
  };
  const Shift shift = shift_of(robot, params.duration);
  Random route_random = stream("route");
  const Drive drive(
      make_route(robot.route, params.area, shift.duration * robot.drive.speed, route_random),
      robot.drive);
  Recording recording;
  recording.robot = name;
  for (const Channel& channel : world.channels()) recording.fields.push_back(channel.name);
  const std::vector<double>& mount = robot.sensor.mounting;
  recording.sensor_in_base = SE2(mount[0], mount[1], mount[2]);
  if (mount != std::vector<double>{0.0, 0.0, 0.0}) recording.sensor_frame = "field_sensor";
  Random odometry_random = stream("odometry");
  record_motion(robot, shift, drive, odometry_random, recording);
  Random sensor_random = stream("sensor");
  record_fields(robot, shift, world, drive, sensor_random, recording);
  Random position_random = stream("position");
  record_positions(robot.position, shift, drive, position_random, recording);
  return recording;
}

}  // namespace

std::vector<Recording> simulate_all(const WorldParams& params, std::uint64_t seed) {
  const World world(params, seed);
  std::vector<Recording> recordings;
  if (params.robots.empty()) recordings.push_back(record(world, params, params, "", seed));
  for (const auto& [name, robot] : params.robots) {
    recordings.push_back(record(world, params, robot, name, seed));
  }
  return recordings;
}

Recording simulate(const WorldParams& params, std::uint64_t seed) {
  return simulate_all(params, seed).front();
}

std::string simulate_survey(const WorldParams& params, std::uint64_t seed, double spacing) {
  const World world(params, seed);
  Random random = random_stream(seed, "survey");
  std::string csv = "x_m,y_m";
  for (const Channel& channel : world.channels()) csv += "," + channel.name;
  csv += "\n";
  const std::vector<double>& area = params.area;
  const std::size_t columns = ticks(area[2] - area[0], 1.0 / spacing);
  const std::size_t rows = ticks(area[3] - area[1], 1.0 / spacing);
  for (std::size_t i = 0; i < rows * columns; ++i) {
    const SE2 place(area[0] + spacing * static_cast<double>(i % columns),
                    area[1] + spacing * static_cast<double>(i / columns), 0.0);
    const std::vector<double> values = read_all(world, place, params.sensor, random);
    if (!any_observed(values)) continue;
    csv += field_core::format_number(place.x()) + "," + field_core::format_number(place.y());
    for (const double value : values) {
      csv += ",";
      if (std::isfinite(value)) csv += field_core::format_number(value);
    }
    csv += "\n";
  }
  return csv;
}

}  // namespace field_bags
