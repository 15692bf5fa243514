#include "report.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

#include "field_core/csv.hpp"
#include "json_writer.hpp"

namespace field_eval {
namespace {

using field_core::TrajectoryErrors;

std::string fixed(std::optional<double> value, int decimals) {
  if (!value || !std::isfinite(*value)) return "-";
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", decimals, *value);
  return text;
}

std::vector<std::string> cells_of(const Row& row) {
  const TrajectoryErrors& e = row.errors;
  auto inside = e.share_inside_90_ellipse;
  if (inside) *inside *= 100.0;
  return {row.name,
          std::to_string(e.poses),
          fixed(e.position.mean, 3),
          fixed(e.position.median, 3),
          fixed(e.position.rmse, 3),
          fixed(e.position.p95, 3),
          fixed(e.position.max, 3),
          fixed(e.position.final, 3),
          fixed(e.yaw.mean, 4),
          fixed(e.relative_position.mean, 3),
          fixed(e.nees, 2),
          inside ? fixed(inside, 1) + " %" : "-"};
}

std::string aligned(const std::vector<std::vector<std::string>>& lines) {
  std::vector<std::size_t> widths(lines.front().size(), 0);
  for (const auto& line : lines) {
    for (std::size_t c = 0; c < line.size(); ++c) widths[c] = std::max(widths[c], line[c].size());
  }
  std::string text;
  for (const auto& line : lines) {
    for (std::size_t c = 0; c < line.size(); ++c) {
      const std::string padding(widths[c] - line[c].size(), ' ');
      text += c == 0 ? line[c] + padding : "  " + padding + line[c];
    }
    text += '\n';
  }
  return text;
}

void write_statistics(JsonWriter& json, const std::string& what, const std::string& unit,
                      const field_core::ErrorStatistics& s) {
  json.number(what + "_mean_" + unit, s.mean);
  json.number(what + "_median_" + unit, s.median);
  json.number(what + "_rmse_" + unit, s.rmse);
  json.number(what + "_p95_" + unit, s.p95);
  json.number(what + "_max_" + unit, s.max);
  json.number(what + "_final_" + unit, s.final);
}

double two_sigma(const field_core::StampedPose& pose) {
  if (!pose.covariance) return std::nan("");
  const Eigen::Matrix2d xy = pose.covariance->topLeftCorner<2, 2>();
  return 2.0 * std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(xy).eigenvalues()[1]);
}

using PoseNumber = std::function<double(const field_core::StampedPose&)>;

void write_column(JsonWriter& json, const std::string& key,
                  const field_core::Trajectory& trajectory, const PoseNumber& number) {
  std::vector<double> values;
  for (const auto& pose : trajectory) values.push_back(number(pose));
  json.numbers(key, values);
}

// The poses that were compared, laid over the truth.
field_core::Trajectory compared_poses(const Row& row) {
  field_core::Trajectory compared;
  for (const auto& pose : row.trajectory) {
    if (!std::binary_search(row.errors.stamps.begin(), row.errors.stamps.end(), pose.stamp))
      continue;
    compared.push_back(pose);
    compared.back().pose = row.errors.alignment * pose.pose;
  }
  return compared;
}

void write_path(JsonWriter& json, const field_core::Trajectory& path, field_core::Stamp start) {
  write_column(json, "time_s", path,
               [start](const auto& pose) { return field_core::to_seconds(pose.stamp - start); });
  write_column(json, "x_m", path, [](const auto& pose) { return pose.pose.x(); });
  write_column(json, "y_m", path, [](const auto& pose) { return pose.pose.y(); });
}

}  // namespace

std::string table(const Evaluation& evaluation) {
  const auto& estimate = evaluation.rows.front().errors;
  std::string text = "Position error [m] over " + fixed(evaluation.duration_s, 1) + " s and " +
                     fixed(evaluation.driven_m, 1) +
                     " m driven, alignment: " + evaluation.alignment + "; RPE over " +
                     fixed(estimate.relative_distance, 2) +
                     " m; NEES of (x, y, yaw): 3 is ideal\n\n";
  std::vector<std::vector<std::string>> lines = {{"trajectory", "poses", "mean", "median", "RMSE",
                                                  "p95", "max", "final", "yaw [rad]", "RPE [m]",
                                                  "NEES", "in 90 %"}};
  for (const auto& row : evaluation.rows) lines.push_back(cells_of(row));
  text += aligned(lines);
  for (const auto& row : evaluation.rows) {
    if (!row.translation_scale) continue;
    text += "\n" + row.name + ": odometry with its translations times " +
            fixed(row.translation_scale, 4) + ", the best constant scale in hindsight\n";
  }
  return text;
}

std::string json(const Evaluation& evaluation) {
  JsonWriter json;
  json.text("truth", evaluation.truth_source);
  json.text("alignment", evaluation.alignment);
  json.number("duration_s", evaluation.duration_s);
  json.number("driven_m", evaluation.driven_m);
  json.begin_list("trajectories");
  for (const auto& row : evaluation.rows) {
    const TrajectoryErrors& e = row.errors;
    json.begin_object();
    json.text("name", row.name);
    json.text("source", row.source);
    json.number("poses", static_cast<double>(e.poses));
    if (row.translation_scale) json.number("translation_scale", *row.translation_scale);
    write_statistics(json, "position_error", "m", e.position);
    write_statistics(json, "yaw_error", "rad", e.yaw);
    json.number("relative_distance_m", e.relative_distance);
    write_statistics(json, "relative_position_error", "m", e.relative_position);
    write_statistics(json, "relative_yaw_error", "rad", e.relative_yaw);
    const double nan = std::nan("");
    json.number("nees", e.nees.value_or(nan));
    json.number("nees_position", e.nees_position.value_or(nan));
    json.number("share_inside_90_ellipse", e.share_inside_90_ellipse.value_or(nan));
    json.end_object();
  }
  json.end_list();
  return json.finish();
}

std::string plot_data(const Evaluation& evaluation) {
  const auto start = evaluation.rows.front().errors.stamps.front();
  JsonWriter json;
  json.text("alignment", evaluation.alignment);
  json.begin_list("trajectories");
  json.begin_object();
  json.text("name", "truth");
  write_path(json, evaluation.truth, start);
  json.end_object();
  for (const auto& row : evaluation.rows) {
    const auto path = compared_poses(row);
    json.begin_object();
    json.text("name", row.name);
    write_path(json, path, start);
    json.numbers("error_m", row.errors.position_errors);
    if (row.errors.nees) write_column(json, "two_sigma_m", path, two_sigma);
    json.number("rmse_m", row.errors.position.rmse);
    json.end_object();
  }
  json.end_list();
  return json.finish();
}

}  // namespace field_eval
