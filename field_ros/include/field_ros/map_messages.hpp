// Predictions of fields as messages for maps and rviz: pure functions.
#pragma once

#include <field_msgs/FieldMap.h>
#include <nav_msgs/OccupancyGrid.h>
#include <sensor_msgs/PointCloud2.h>
#include <visualization_msgs/MarkerArray.h>

#include <string>
#include <vector>

#include "field_core/estimator.hpp"
#include "field_ros/field_grid.hpp"

namespace field_ros {

/// A prediction on a grid: column i + j * width of `prediction` is cell (i, j).
struct PredictedGrid {
  FieldGrid grid;
  std::vector<field_core::FieldInfo> fields;
  field_core::FieldPrediction prediction;
  field_core::Stamp stamp{0};
  std::string frame;
};

/// Cells whose variance is above this share of FieldPrediction::prior_variance are "not known yet".
constexpr double kUnknownShare = 0.9;

field_msgs::FieldMap to_field_map(const PredictedGrid& map, std::size_t field);

/// Smallest and largest mean (or standard deviation) of the cells that are known; 0, 0 if none is.
struct ValueRange {
  double low = 0.0, high = 0.0;
};
ValueRange known_range(const PredictedGrid& map, std::size_t field, bool stddev);

/// The mean (or standard deviation) scaled so that the smallest value of a known cell is 0 and the
/// largest 100 (all 0 if they are equal); -1 where the field is not known yet.
nav_msgs::OccupancyGrid to_occupancy_grid(const PredictedGrid& map, std::size_t field, bool stddev);

/// One point per cell at z = 0: x, y, z, then FIELD and FIELD_stddev for each field, float32.
sensor_msgs::PointCloud2 to_point_cloud(const PredictedGrid& map);

/// One point per particle (gmrf_slap: candidate position) at z = 0: x, y, z, yaw, and its weight as
/// intensity, by which rviz colours.
sensor_msgs::PointCloud2 to_weighted_cloud(const field_core::Belief& belief,
                                           const std::string& frame);

/// The 90 % ellipse of the position as a flat cylinder and the heading as an arrow.
visualization_msgs::MarkerArray to_markers(const field_core::Belief& belief,
                                           const std::string& frame);

}  // namespace field_ros
