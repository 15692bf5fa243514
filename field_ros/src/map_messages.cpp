#include "field_ros/map_messages.hpp"

#include <sensor_msgs/point_cloud2_iterator.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "field_ros/convert.hpp"

namespace field_ros {
namespace {

// Chi-square quantile of 2 degrees of freedom at 90 %: -2 ln(0.1).
const double kChiSquare90 = -2.0 * std::log(0.1);
constexpr double kThinnestMarker = 1e-3;

std_msgs::Header header(const PredictedGrid& map) {
  std_msgs::Header h;
  h.stamp = to_ros(map.stamp);
  h.frame_id = map.frame;
  return h;
}

nav_msgs::MapMetaData info(const PredictedGrid& map) {
  nav_msgs::MapMetaData info;
  info.map_load_time = to_ros(map.stamp);
  info.resolution = static_cast<float>(map.grid.resolution);
  info.width = static_cast<std::uint32_t>(map.grid.width);
  info.height = static_cast<std::uint32_t>(map.grid.height);
  info.origin = to_pose(field_core::SE2(map.grid.x_min, map.grid.y_min, 0.0));
  return info;
}

// Channels of 32-bit floats, the data still zero.
sensor_msgs::PointCloud2 float_cloud(const std::vector<std::string>& channels, std::uint32_t width,
                                     std::uint32_t height) {
  sensor_msgs::PointCloud2 out;
  out.height = height;
  out.width = width;
  out.point_step = static_cast<std::uint32_t>(4 * channels.size());
  out.row_step = out.point_step * out.width;
  out.is_dense = true;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    sensor_msgs::PointField field;
    field.name = channels[c];
    field.offset = static_cast<std::uint32_t>(4 * c);
    field.datatype = sensor_msgs::PointField::FLOAT32;
    field.count = 1;
    out.fields.push_back(field);
  }
  out.data.resize(std::size_t{out.row_step} * out.height);
  return out;
}

Eigen::RowVectorXd values_of(const PredictedGrid& map, std::size_t field, bool stddev) {
  const auto row = static_cast<Eigen::Index>(field);
  if (stddev) return map.prediction.variance.row(row).cwiseSqrt();
  return map.prediction.mean.row(row);
}

Eigen::Array<bool, 1, Eigen::Dynamic> known_cells(const PredictedGrid& map, std::size_t field) {
  const auto row = static_cast<Eigen::Index>(field);
  return map.prediction.variance.row(row).array() <=
         kUnknownShare * map.prediction.prior_variance(row);
}

}  // namespace

field_msgs::FieldMap to_field_map(const PredictedGrid& map, std::size_t field) {
  const auto row = static_cast<Eigen::Index>(field);
  field_msgs::FieldMap out;
  out.header = header(map);
  out.info = info(map);
  out.name = map.fields[field].name;
  out.unit = map.fields[field].unit;
  for (Eigen::Index i = 0; i < map.prediction.mean.cols(); ++i) {
    out.mean.push_back(static_cast<float>(map.prediction.mean(row, i)));
    out.variance.push_back(static_cast<float>(map.prediction.variance(row, i)));
  }
  return out;
}

ValueRange known_range(const PredictedGrid& map, std::size_t field, bool stddev) {
  const Eigen::RowVectorXd values = values_of(map, field, stddev);
  const auto known = known_cells(map, field);
  ValueRange range{std::numeric_limits<double>::infinity(),
                   -std::numeric_limits<double>::infinity()};
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    if (!known(i)) continue;
    range.low = std::min(range.low, values(i));
    range.high = std::max(range.high, values(i));
  }
  return range.low <= range.high ? range : ValueRange{};
}

nav_msgs::OccupancyGrid to_occupancy_grid(const PredictedGrid& map, std::size_t field,
                                          bool stddev) {
  const Eigen::RowVectorXd values = values_of(map, field, stddev);
  const auto known = known_cells(map, field);
  const auto [low, high] = known_range(map, field, stddev);
  const double scale = high > low ? 100.0 / (high - low) : 0.0;
  nav_msgs::OccupancyGrid out;
  out.header = header(map);
  out.info = info(map);
  out.data.resize(static_cast<std::size_t>(values.size()), -1);
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    if (!known(i)) continue;
    out.data[static_cast<std::size_t>(i)] =
        static_cast<std::int8_t>(std::lround((values(i) - low) * scale));
  }
  return out;
}

sensor_msgs::PointCloud2 to_point_cloud(const PredictedGrid& map) {
  std::vector<std::string> channels = {"x", "y", "z"};
  for (const auto& field : map.fields) {
    channels.push_back(field.name);
    channels.push_back(field.name + "_stddev");
  }
  sensor_msgs::PointCloud2 out = float_cloud(channels, static_cast<std::uint32_t>(map.grid.width),
                                             static_cast<std::uint32_t>(map.grid.height));
  out.header = header(map);
  const Eigen::Matrix2Xd centres = map.grid.centres();
  sensor_msgs::PointCloud2Iterator<float> value(out, "x");
  for (Eigen::Index i = 0; i < centres.cols(); ++i, ++value) {
    value[0] = static_cast<float>(centres(0, i));
    value[1] = static_cast<float>(centres(1, i));
    value[2] = 0.0F;
    for (Eigen::Index f = 0; f < map.prediction.mean.rows(); ++f) {
      value[3 + 2 * static_cast<int>(f)] = static_cast<float>(map.prediction.mean(f, i));
      value[4 + 2 * static_cast<int>(f)] =
          static_cast<float>(std::sqrt(map.prediction.variance(f, i)));
    }
  }
  return out;
}

sensor_msgs::PointCloud2 to_weighted_cloud(const field_core::Belief& belief,
                                           const std::string& frame) {
  sensor_msgs::PointCloud2 out = float_cloud(
      {"x", "y", "z", "yaw", "intensity"}, static_cast<std::uint32_t>(belief.particles.size()), 1);
  out.header.stamp = to_ros(belief.stamp);
  out.header.frame_id = frame;
  sensor_msgs::PointCloud2Iterator<float> value(out, "x");
  for (const auto& particle : belief.particles) {
    value[0] = static_cast<float>(particle.pose.x());
    value[1] = static_cast<float>(particle.pose.y());
    value[2] = 0.0F;
    value[3] = static_cast<float>(particle.pose.yaw());
    value[4] = static_cast<float>(particle.weight);
    ++value;
  }
  return out;
}

visualization_msgs::MarkerArray to_markers(const field_core::Belief& belief,
                                           const std::string& frame) {
  visualization_msgs::Marker ellipse;
  ellipse.header.stamp = to_ros(belief.stamp);
  ellipse.header.frame_id = frame;
  ellipse.ns = "position_90_percent";
  ellipse.type = visualization_msgs::Marker::CYLINDER;
  ellipse.color.g = ellipse.color.b = 0.7F;
  ellipse.color.a = 0.4F;
  visualization_msgs::Marker arrow = ellipse;

  const Eigen::Matrix2d covariance = belief.covariance.topLeftCorner<2, 2>();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(covariance);
  const Eigen::Vector2d axis = solver.eigenvectors().col(1);  // of the larger eigenvalue
  ellipse.pose = to_pose({belief.mean.x(), belief.mean.y(), std::atan2(axis.y(), axis.x())});
  const auto diameter = [&solver](int i) {
    return std::max(kThinnestMarker,
                    2.0 * std::sqrt(kChiSquare90 * std::max(0.0, solver.eigenvalues()(i))));
  };
  ellipse.scale.x = diameter(1);
  ellipse.scale.y = diameter(0);
  ellipse.scale.z = 0.01;

  arrow.ns = "heading";
  arrow.type = visualization_msgs::Marker::ARROW;
  arrow.pose = to_pose(belief.mean);
  arrow.scale.x = 0.6;
  arrow.scale.y = arrow.scale.z = 0.1;
  arrow.color.a = 1.0F;
  visualization_msgs::MarkerArray out;
  out.markers = {ellipse, arrow};
  return out;
}

}  // namespace field_ros
