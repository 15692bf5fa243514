#include "field_ros/replay_output.hpp"

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <sstream>

#include "field_core/csv.hpp"
#include "field_core/trajectory.hpp"
#include "field_ros/field_grid.hpp"
#include "field_ros/map_files.hpp"
#include "field_ros/publishers.hpp"
#include "field_ros/state_file.hpp"

namespace field_ros {
namespace {

using field_core::format_number;
using field_core::format_stamp;

// trajectory.hpp's lines come without their end.
std::string line(std::string text) {
  if (text.empty() || text.back() != '\n') text += '\n';
  return text;
}

// Estimators may bound what one call handles well; a few thousand points keep memory flat.
constexpr Eigen::Index kChunk = 4096;

template <class OnPoint>
void predict_points(const Session& session, const Eigen::Matrix2Xd& points, OnPoint on_point) {
  for (Eigen::Index start = 0; start < points.cols(); start += kChunk) {
    const Eigen::Index n = std::min(kChunk, points.cols() - start);
    const Eigen::Matrix2Xd chunk = points.middleCols(start, n);
    const field_core::FieldPrediction prediction = session.estimator().predict_field(chunk);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index f = 0; f < prediction.mean.rows(); ++f) {
        on_point(chunk.col(i), static_cast<std::size_t>(f), prediction.mean(f, i),
                 prediction.variance(f, i));
      }
    }
  }
}

std::string json_counts(const Counts& counts) {
  std::string text;
  for (const auto& [name, count] : counts) {
    text += (text.empty() ? "" : ", ") + ("\"" + name + "\": " + std::to_string(count));
  }
  return "{" + text + "}";
}

// The numbers of one robot, or of all: members of an object that has some before.
std::string json_numbers(const SessionCounts& c, const std::string& indent) {
  const std::string nis =
      c.nis_dof_sum == 0 ? "null" : format_number(c.nis_sum / static_cast<double>(c.nis_dof_sum));
  std::ostringstream out;
  const auto member = [&](const char* key, const auto& value) {
    out << ",\n" << indent << "\"" << key << "\": " << value;
  };
  member("odometry_messages", c.odometry);
  member("measurement_messages", c.measurements);
  member("steps", c.steps);
  member("applied", c.applied);
  member("lost", c.lost);
  member("skipped", json_counts(c.skipped));
  member("noted", json_counts(c.noted));
  member("dropped", json_counts(c.dropped));
  member("unknown_field_names", c.unknown_fields);
  member("numerical_errors", c.numerical_errors);
  member("clock_resets", c.clock_resets);
  member("recoveries", c.recoveries);
  member("nis_per_dof", nis);
  return out.str();
}

std::string json_final_pose(const field_core::Belief& b, const std::string& indent) {
  return ",\n" + indent + "\"final_pose\": {\"stamp_s\": " + format_stamp(b.stamp) +
         ", \"x_m\": " + format_number(b.mean.x()) + ", \"y_m\": " + format_number(b.mean.y()) +
         ", \"yaw_rad\": " + format_number(b.mean.yaw()) + "}";
}

}  // namespace

void ReplayOutput::add(const SessionStep& step) {
  const field_core::Belief& b = step.belief;
  Lines& lines = robots_[step.robot];
  // Of two steps at one stamp (two sensors) the later one holds.
  const bool again = lines.stamp && *lines.stamp == b.stamp;
  lines.estimate_tum.resize(again ? lines.last_tum : lines.estimate_tum.size());
  lines.estimate_csv.resize(again ? lines.last_csv : lines.estimate_csv.size());
  lines.stamp = b.stamp;
  lines.last_tum = lines.estimate_tum.size();
  lines.last_csv = lines.estimate_csv.size();
  lines.estimate_tum += line(field_core::tum_line(b.stamp, b.mean));
  lines.estimate_csv += line(field_core::estimate_csv_line(b.stamp, b.mean, b.covariance));
  lines.timing_csv += format_stamp(b.stamp) + "," + format_number(step.step_s) + "\n";
}

void ReplayOutput::add_trajectories(const Session& session) {
  for (int robot = 0; robot < session.robots(); ++robot) {
    const Lines& lines = robots_[robot];
    const std::string name = session.robots() == 1 ? "" : "_" + session.interface(robot).name;
    files_["estimate" + name + ".tum"] = lines.estimate_tum;
    files_["estimate" + name + ".csv"] = line(field_core::kEstimateCsvHeader) + lines.estimate_csv;
    files_["timing" + name + ".csv"] = "stamp_s,step_s\n" + lines.timing_csv;
  }
}

void ReplayOutput::add_map_files(const Session& session) {
  files_.merge(map_files(predict_grid(session)));
}

void ReplayOutput::add_fields(const Session& session) {
  const auto& fields = session.estimator().fields();
  const FieldGrid grid =
      FieldGrid::cover(session.estimator().map_region(), session.params().map_resolution);
  std::vector<std::string> texts(fields.size(), "x_m,y_m,mean,variance\n");
  predict_points(session, grid.centres(),
                 [&texts](const auto& point, std::size_t field, double mean, double variance) {
                   texts[field] += format_number(point.x()) + "," + format_number(point.y()) + "," +
                                   format_number(mean) + "," + format_number(variance) + "\n";
                 });
  for (std::size_t f = 0; f < fields.size(); ++f) {
    files_["field_" + fields[f].name + ".csv"] = std::move(texts[f]);
  }
}

void ReplayOutput::add_prediction(const Session& session, const std::string& points_csv) {
  const field_core::CsvTable table = field_core::CsvTable::read(points_csv);
  const std::size_t x = table.column("x_m"), y = table.column("y_m");
  Eigen::Matrix2Xd points(2, static_cast<Eigen::Index>(table.rows()));
  for (std::size_t row = 0; row < table.rows(); ++row) {
    points.col(static_cast<Eigen::Index>(row)) << table.number(row, x), table.number(row, y);
  }
  const auto& fields = session.estimator().fields();
  std::string text = "x_m,y_m,field,mean,variance\n";
  predict_points(session, points,
                 [&](const auto& point, std::size_t field, double mean, double variance) {
                   text += format_number(point.x()) + "," + format_number(point.y()) + "," +
                           fields[field].name + "," + format_number(mean) + "," +
                           format_number(variance) + "\n";
                 });
  files_["prediction.csv"] = std::move(text);
}

void ReplayOutput::add_summary(const Session& session, const std::string& estimator,
                               std::uint64_t seed, double duration_s, std::size_t left_waiting) {
  std::ostringstream out;
  out << "{\n  \"estimator\": \"" << estimator << "\",\n  \"seed\": " << seed
      << ",\n  \"duration_s\": " << format_number(duration_s) << json_numbers(session.total(), "  ")
      << ",\n  \"left_waiting_for_odometry\": " << left_waiting;
  if (session.robots() == 1) {
    out << json_final_pose(session.belief(), "  ");
  } else {
    out << ",\n  \"robots\": {";
    for (int robot = 0; robot < session.robots(); ++robot) {
      const std::string& name = session.interface(robot).name;
      out << (robot > 0 ? "," : "") << "\n    \"" << name << "\": {\n      \"name\": \"" << name
          << "\"" << json_numbers(session.counts(robot), "      ")
          << json_final_pose(session.belief(robot), "      ") << "\n    }";
    }
    out << "\n  }";
  }
  out << "\n}\n";
  files_["summary.json"] = out.str();
}

void ReplayOutput::write(const std::string& directory) {
  namespace fs = std::filesystem;
  const bool existed = fs::exists(directory);
  create_directories(directory);
  const fs::path temporary = fs::path(directory) / (".partial-" + std::to_string(::getpid()));
  try {
    create_directories(temporary.string());
    for (const auto& [name, content] : files_) {
      field_core::write_file_atomically((temporary / name).string(), content);
    }
    for (const auto& [name, content] : files_)
      fs::rename(temporary / name, fs::path(directory) / name);
    fs::remove(temporary);
  } catch (const std::exception& e) {
    std::error_code ignored;
    fs::remove_all(temporary, ignored);
    if (!existed) fs::remove_all(directory, ignored);
    if (dynamic_cast<const fs::filesystem_error*>(&e)) {
      throw field_core::DataError(directory + ": cannot be written: " + e.what() +
                                  "; choose another --output");
    }
    throw;
  }
}

}  // namespace field_ros
