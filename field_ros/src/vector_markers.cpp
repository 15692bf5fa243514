#include "field_ros/vector_markers.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "field_ros/convert.hpp"

namespace field_ros {
namespace {

constexpr double kChiSquare90 = 4.605170185988092;  // 2 degrees of freedom
constexpr double kArrowHeight = 0.05;               // [m] above the maps

using visualization_msgs::Marker;

struct VectorField {
  std::string name;
  Eigen::Index x, y;  // rows of the prediction
};

std::vector<VectorField> vector_fields(const std::vector<field_core::FieldInfo>& fields) {
  std::vector<VectorField> found;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const std::string& name = fields[i].name;
    if (name.size() < 3 || name.compare(name.size() - 2, 2, "_x") != 0) continue;
    const std::string stem = name.substr(0, name.size() - 2);
    for (std::size_t j = 0; j < fields.size(); ++j) {
      if (fields[j].name == stem + "_y") {
        found.push_back({stem, static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)});
      }
    }
  }
  return found;
}

Marker marker(const PredictedGrid& map, const std::string& name, int type, int id) {
  Marker m;
  m.header.frame_id = map.frame;
  m.header.stamp = to_ros(map.stamp);
  m.ns = name;
  m.id = id;
  m.type = type;
  m.color.r = 1.0F, m.color.g = 0.47F, m.color.b = 0.35F, m.color.a = 1.0F;
  m.pose.position.z = kArrowHeight;
  return m;
}

// Cells that get an arrow, known in both components.
std::vector<Eigen::Index> chosen_cells(const PredictedGrid& map, const VectorField& v, int stride) {
  std::vector<Eigen::Index> cells;
  const auto& p = map.prediction;
  for (int j = stride / 2; j < map.grid.height; j += stride) {
    for (int i = stride / 2; i < map.grid.width; i += stride) {
      const Eigen::Index cell = i + Eigen::Index{j} * map.grid.width;
      if (p.variance(v.x, cell) < kUnknownShare * p.prior_variance(v.x) &&
          p.variance(v.y, cell) < kUnknownShare * p.prior_variance(v.y)) {
        cells.push_back(cell);
      }
    }
  }
  return cells;
}

// Of nine arrows in ten no one is longer: a single strong source would leave dots everywhere else.
double usual_length(const PredictedGrid& map, const VectorField& v,
                    const std::vector<Eigen::Index>& cells) {
  std::vector<double> lengths;
  for (const Eigen::Index c : cells) {
    lengths.push_back(std::hypot(map.prediction.mean(v.x, c), map.prediction.mean(v.y, c)));
  }
  if (lengths.empty()) return 0.0;
  const auto rank = lengths.begin() + static_cast<std::ptrdiff_t>(9 * (lengths.size() - 1) / 10);
  std::nth_element(lengths.begin(), rank, lengths.end());
  return *rank;
}

void append(const PredictedGrid& map, const VectorField& v, int stride,
            visualization_msgs::MarkerArray& out) {
  const std::vector<Eigen::Index> cells = chosen_cells(map, v, stride);
  const Eigen::Matrix2Xd centres = map.grid.centres();
  const auto& p = map.prediction;
  const double scale = usual_length(map, v, cells);
  if (!(scale > 0.0)) return;
  const double spacing = stride * map.grid.resolution;
  const double metres = spacing / scale;  // per unit of the field
  for (const Eigen::Index c : cells) {
    const Eigen::Vector2d value(p.mean(v.x, c), p.mean(v.y, c));
    Marker arrow = marker(map, v.name, Marker::ARROW, static_cast<int>(c));
    arrow.pose = to_pose({centres(0, c), centres(1, c), std::atan2(value.y(), value.x())});
    arrow.pose.position.z = kArrowHeight;
    arrow.scale.x = std::max(1e-3, metres * value.norm());
    arrow.scale.y = arrow.scale.z = 0.12 * spacing;
    Marker ellipse = marker(map, v.name + " 90 %", Marker::CYLINDER, static_cast<int>(c));
    const Eigen::Vector2d tip = centres.col(c) + metres * value;
    ellipse.pose.position.x = tip.x(), ellipse.pose.position.y = tip.y();
    ellipse.pose.orientation.w = 1.0;
    ellipse.scale.x = 2.0 * metres * std::sqrt(kChiSquare90 * p.variance(v.x, c));
    ellipse.scale.y = 2.0 * metres * std::sqrt(kChiSquare90 * p.variance(v.y, c));
    ellipse.scale.z = 0.01;
    ellipse.color.a = 0.25F;
    out.markers.push_back(arrow);
    out.markers.push_back(ellipse);
  }
}

}  // namespace

visualization_msgs::MarkerArray to_vector_markers(const PredictedGrid& map, int per_side) {
  visualization_msgs::MarkerArray out;
  const int longer = std::max(map.grid.width, map.grid.height);
  const int stride = std::max(1, (longer + per_side - 1) / per_side);
  for (const VectorField& v : vector_fields(map.fields)) append(map, v, stride, out);
  return out;
}

void delete_missing(const visualization_msgs::MarkerArray& before,
                    visualization_msgs::MarkerArray& now) {
  std::set<std::pair<std::string, int>> kept;
  for (const Marker& m : now.markers) kept.emplace(m.ns, m.id);
  for (Marker m : before.markers) {
    if (m.action == Marker::DELETE || kept.count({m.ns, m.id})) continue;
    m.action = Marker::DELETE;
    now.markers.push_back(m);
  }
}

}  // namespace field_ros
