#include "field_core/trajectory.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "field_core/csv.hpp"
#include "field_core/errors.hpp"

namespace field_core {
namespace {

constexpr std::array<const char*, 6> kCovarianceColumns = {"cov_xx", "cov_xy", "cov_xa",
                                                           "cov_yy", "cov_ya", "cov_aa"};

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

void append(Trajectory& trajectory, StampedPose&& pose, const std::string& where) {
  if (!trajectory.empty() && pose.stamp <= trajectory.back().stamp) {
    throw DataError(where + "stamp " + format_stamp(pose.stamp) + " is not later than " +
                    format_stamp(trajectory.back().stamp) +
                    " of the pose before; sort the rows by stamp and remove doubles");
  }
  trajectory.push_back(std::move(pose));
}

double yaw_of(const std::array<double, 4>& q, const std::string& where) {
  const double norm2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  if (!(std::abs(norm2 - 1.0) < 0.02)) {
    throw DataError(where + "the quaternion has length " + format_number(std::sqrt(norm2)) +
                    "; it must be 1, in the order qx qy qz qw");
  }
  return std::atan2(2.0 * (q[3] * q[2] + q[0] * q[1]), norm2 - 2.0 * (q[1] * q[1] + q[2] * q[2]));
}

StampedPose tum_pose(const std::string& content, const std::string& where) {
  std::istringstream in(content);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  if (words.size() != 8) {
    throw DataError(where + std::to_string(words.size()) +
                    " values; a .tum line is: stamp tx ty tz qx qy qz qw");
  }
  std::array<double, 7> v;
  for (std::size_t i = 0; i < v.size(); ++i) {
    const auto value = parse_number(words[i + 1]);
    if (!value) {
      throw DataError(where + "'" + words[i + 1] +
                      "' is not a finite number; correct it or remove the line");
    }
    v[i] = *value;
  }
  StampedPose pose;
  try {
    pose.stamp = parse_stamp(words[0]);
  } catch (const DataError& error) {
    throw DataError(where + error.what());
  }
  pose.pose = SE2(v[0], v[1], yaw_of({v[3], v[4], v[5], v[6]}, where));
  return pose;
}

Trajectory read_tum(const std::string& path) {
  std::istringstream in(read_file(path));
  Trajectory trajectory;
  std::string content;
  for (std::size_t line = 1; std::getline(in, content); ++line) {
    const auto first = content.find_first_not_of(" \t\r");
    if (first == std::string::npos || content[first] == '#') continue;
    const std::string where = path + ":" + std::to_string(line) + ": ";
    append(trajectory, tum_pose(content, where), where);
  }
  if (trajectory.empty()) {
    throw DataError(path + ": holds no pose; a .tum line is: stamp tx ty tz qx qy qz qw");
  }
  return trajectory;
}

// Empty cells in all six columns: this pose has no covariance.
std::optional<Eigen::Matrix3d> covariance_of(const CsvTable& table, std::size_t row,
                                             const std::array<std::size_t, 6>& columns) {
  if (std::all_of(columns.begin(), columns.end(),
                  [&](std::size_t column) { return table.empty(row, column); })) {
    return std::nullopt;
  }
  std::array<double, 6> c;
  for (std::size_t i = 0; i < c.size(); ++i) c[i] = table.number(row, columns[i]);
  Eigen::Matrix3d covariance;
  covariance << c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5];
  return covariance;
}

}  // namespace

const char* const kEstimateCsvHeader =
    "stamp_s,x_m,y_m,yaw_rad,cov_xx,cov_xy,cov_xa,cov_yy,cov_ya,cov_aa";

Trajectory trajectory_from_csv(const CsvTable& table) {
  const std::size_t stamp = table.column("stamp_s"), x = table.column("x_m"),
                    y = table.column("y_m"), yaw = table.column("yaw_rad");
  const bool has_covariance = std::any_of(kCovarianceColumns.begin(), kCovarianceColumns.end(),
                                          [&](const char* name) { return table.has_column(name); });
  std::array<std::size_t, 6> columns{};
  for (std::size_t i = 0; has_covariance && i < columns.size(); ++i) {
    columns[i] = table.column(kCovarianceColumns[i]);
  }
  Trajectory trajectory;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    StampedPose pose;
    pose.stamp = table.stamp(row, stamp);
    pose.pose = SE2(table.number(row, x), table.number(row, y), table.number(row, yaw));
    if (has_covariance) pose.covariance = covariance_of(table, row, columns);
    append(trajectory, std::move(pose),
           table.path() + ":" + std::to_string(table.line(row)) + ": ");
  }
  if (trajectory.empty()) {
    throw DataError(table.path() + ": holds no pose; rows below the header are needed");
  }
  return trajectory;
}

Trajectory read_trajectory(const std::string& path) {
  if (ends_with(path, ".csv")) return trajectory_from_csv(CsvTable::read(path));
  if (ends_with(path, ".tum")) return read_tum(path);
  throw DataError("'" + path + "' is neither a .tum nor a .csv file; rename it after its format");
}

Trajectory between_stamps(const Trajectory& trajectory, Stamp from, Stamp to) {
  Trajectory part;
  std::copy_if(trajectory.begin(), trajectory.end(), std::back_inserter(part),
               [&](const StampedPose& p) { return from <= p.stamp && p.stamp <= to; });
  return part;
}

std::optional<SE2> pose_at(const Trajectory& trajectory, Stamp stamp) {
  const auto after =
      std::lower_bound(trajectory.begin(), trajectory.end(), stamp,
                       [](const StampedPose& pose, Stamp wanted) { return pose.stamp < wanted; });
  if (after == trajectory.end()) return std::nullopt;
  if (after->stamp == stamp) return after->pose;
  if (after == trajectory.begin()) return std::nullopt;
  const auto before = std::prev(after);
  const double fraction = static_cast<double>((stamp - before->stamp).count()) /
                          static_cast<double>((after->stamp - before->stamp).count());
  return interpolate(before->pose, after->pose, fraction);
}

std::string tum_line(Stamp stamp, const SE2& pose) {
  return format_stamp(stamp) + " " + format_number(pose.x()) + " " + format_number(pose.y()) +
         " 0 0 0 " + format_number(std::sin(0.5 * pose.yaw())) + " " +
         format_number(std::cos(0.5 * pose.yaw()));
}

std::string estimate_csv_line(Stamp stamp, const SE2& pose, const Eigen::Matrix3d& c) {
  std::string line = format_stamp(stamp);
  for (const double value :
       {pose.x(), pose.y(), pose.yaw(), c(0, 0), c(0, 1), c(0, 2), c(1, 1), c(1, 2), c(2, 2)}) {
    line += "," + format_number(value);
  }
  return line;
}

}  // namespace field_core
