#include "field_bags/csv_recording.hpp"

#include <limits>

#include "field_core/csv.hpp"
#include "field_core/errors.hpp"

namespace field_bags {
namespace {

using field_core::CsvTable;
using field_core::DataError;
using field_core::Stamp;

/// The stamp of a row, checked against the one before.
Stamp next_stamp(const CsvTable& table, std::size_t row, std::size_t column,
                 const Stamp* previous) {
  const Stamp stamp = table.stamp(row, column);
  const std::string place = table.path() + ":" + std::to_string(table.line(row)) + ": ";
  if (stamp < Stamp(0)) {
    throw DataError(place + "column 'stamp_s': " + field_core::format_stamp(stamp) +
                    " is before 0, which ROS time cannot hold; shift the clock of all logs alike");
  }
  if (previous && stamp <= *previous) {
    throw DataError(place + "column 'stamp_s': " + field_core::format_stamp(stamp) +
                    " does not come after " + field_core::format_stamp(*previous) +
                    " of the row before; sort the rows by stamp_s and drop duplicates");
  }
  return stamp;
}

field_core::Trajectory read_poses(const std::string& path) {
  const CsvTable table = CsvTable::read(path);
  const std::size_t stamp = table.column("stamp_s"), x = table.column("x_m"),
                    y = table.column("y_m"), yaw = table.column("yaw_rad");
  field_core::Trajectory poses;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    field_core::StampedPose pose;
    pose.stamp = next_stamp(table, row, stamp, row == 0 ? nullptr : &poses.back().stamp);
    pose.pose = field_core::SE2(table.number(row, x), table.number(row, y), table.number(row, yaw));
    poses.push_back(pose);
  }
  if (poses.empty()) throw DataError(path + ": has a header but no row; nothing was recorded");
  return poses;
}

void read_measurements(const std::string& path, Recording& recording) {
  const CsvTable table = CsvTable::read(path);
  const std::size_t stamp_column = table.column("stamp_s");
  std::vector<std::size_t> columns;
  for (std::size_t c = 0; c < table.columns().size(); ++c) {
    if (c == stamp_column) continue;
    columns.push_back(c);
    recording.fields.push_back(table.columns()[c]);
  }
  if (columns.empty()) {
    throw DataError(path + ":1: has no column beside 'stamp_s'; add one column per field");
  }
  Stamp previous{0};
  for (std::size_t row = 0; row < table.rows(); ++row) {
    FieldRow reading;
    reading.stamp = previous = next_stamp(table, row, stamp_column, row == 0 ? nullptr : &previous);
    bool observed = false;
    for (const std::size_t c : columns) {
      const bool empty = table.empty(row, c);
      observed = observed || !empty;
      reading.values.push_back(empty ? std::numeric_limits<double>::quiet_NaN()
                                     : table.number(row, c));
    }
    if (observed) recording.measurements.push_back(reading);
  }
  if (recording.measurements.empty()) {
    throw DataError(path + ": no row has a value; fill in what the sensors read");
  }
}

}  // namespace

Recording read_csv_recording(const std::string& odometry, const std::string& measurements,
                             const std::string& truth) {
  Recording recording;
  recording.odometry = read_poses(odometry);
  read_measurements(measurements, recording);
  if (!truth.empty()) recording.truth = read_poses(truth);
  return recording;
}

}  // namespace field_bags
