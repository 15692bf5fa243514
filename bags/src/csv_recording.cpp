#include "field_bags/csv_recording.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
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
                    " of the row before; sort the rows by stamp_s and drop duplicates (csv_to_bag "
                    "--sort does it for measurements)");
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

FieldRow read_row(const CsvTable& table, std::size_t row, const std::vector<std::size_t>& columns) {
  FieldRow reading;
  for (const std::size_t c : columns) {
    reading.values.push_back(table.empty(row, c) ? std::numeric_limits<double>::quiet_NaN()
                                                 : table.number(row, c));
  }
  return reading;
}

bool observes_anything(const FieldRow& row) {
  return std::any_of(row.values.begin(), row.values.end(), [](double v) { return !std::isnan(v); });
}

/// Rows in the order of their stamps; those that share one become one, in which the first reading
/// of a field stands. @param repeated counts the others
std::vector<FieldRow> sorted(const CsvTable& table, std::size_t stamp_column,
                             const std::vector<std::size_t>& columns, std::size_t& repeated) {
  std::vector<std::pair<Stamp, std::size_t>> order;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    order.emplace_back(next_stamp(table, row, stamp_column, nullptr), row);
  }
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<FieldRow> rows;
  for (const auto& [stamp, row] : order) {
    FieldRow reading = read_row(table, row, columns);
    reading.stamp = stamp;
    if (rows.empty() || rows.back().stamp != stamp) {
      rows.push_back(reading);
      continue;
    }
    for (std::size_t f = 0; f < reading.values.size(); ++f) {
      double& value = rows.back().values[f];
      if (std::isnan(value)) {
        value = reading.values[f];
      } else {
        repeated += !std::isnan(reading.values[f]);
      }
    }
  }
  return rows;
}

std::vector<FieldRow> as_they_come(const CsvTable& table, std::size_t stamp_column,
                                   const std::vector<std::size_t>& columns) {
  std::vector<FieldRow> rows;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const Stamp stamp =
        next_stamp(table, row, stamp_column, row == 0 ? nullptr : &rows.back().stamp);
    rows.push_back(read_row(table, row, columns));
    rows.back().stamp = stamp;
  }
  return rows;
}

void read_measurements(const std::string& path, RowOrder order, Recording& recording) {
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
  const auto rows = order == RowOrder::any
                        ? sorted(table, stamp_column, columns, recording.repeated)
                        : as_they_come(table, stamp_column, columns);
  std::copy_if(rows.begin(), rows.end(), std::back_inserter(recording.measurements),
               observes_anything);
  if (recording.measurements.empty()) {
    throw DataError(path + ": no row has a value; fill in what the sensors read");
  }
}

}  // namespace

Recording read_csv_recording(const std::string& odometry, const std::string& measurements,
                             const std::string& truth, RowOrder order) {
  Recording recording;
  recording.odometry = read_poses(odometry);
  read_measurements(measurements, order, recording);
  if (!truth.empty()) recording.truth = read_poses(truth);
  return recording;
}

}  // namespace field_bags
