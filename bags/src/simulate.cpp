#include "field_bags/simulate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "field_core/csv.hpp"

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

void record_motion(const WorldParams& params, const Drive& drive, Random& random,
                   Recording& recording) {
  SE2 odometry, before = drive.at(0.0);
  for (std::size_t k = 0; k < ticks(params.duration, params.odometry.rate); ++k) {
    const Stamp since = tick(k, params.odometry.rate);
    const SE2 truth = drive.at(field_core::to_seconds(since));
    odometry = odometry * reported_motion(before.between(truth), params.odometry, random);
    before = truth;
    recording.truth.push_back({kStart + since, rounded(truth), std::nullopt});
    recording.odometry.push_back({kStart + since, rounded(odometry), std::nullopt});
  }
}

void record_fields(const WorldParams& params, const World& world, const Drive& drive,
                   Random& random, Recording& recording) {
  for (std::size_t k = 0; k < ticks(params.duration, params.sensor.rate); ++k) {
    const Stamp since = tick(k, params.sensor.rate);
    const SE2 sensor = drive.at(field_core::to_seconds(since)) * recording.sensor_in_base;
    FieldRow row{kStart + since, read_all(world, sensor, params.sensor, random)};
    if (any_observed(row.values)) recording.measurements.push_back(std::move(row));
  }
}

}  // namespace

Recording simulate(const WorldParams& params, std::uint64_t seed) {
  const World world(params, seed);
  Random route_random = random_stream(seed, "route");
  const Drive drive(
      make_route(params.route, params.area, params.duration * params.drive.speed, route_random),
      params.drive);
  Recording recording;
  for (const Channel& channel : world.channels()) recording.fields.push_back(channel.name);
  const std::vector<double>& mount = params.sensor.mounting;
  recording.sensor_in_base = SE2(mount[0], mount[1], mount[2]);
  if (mount != std::vector<double>{0.0, 0.0, 0.0}) recording.sensor_frame = "field_sensor";
  Random odometry_random = random_stream(seed, "odometry");
  record_motion(params, drive, odometry_random, recording);
  Random sensor_random = random_stream(seed, "sensor");
  record_fields(params, world, drive, sensor_random, recording);
  return recording;
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
