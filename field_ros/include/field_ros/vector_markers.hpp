// Fields that are components of a vector as arrows for rviz.
#pragma once

#include <visualization_msgs/MarkerArray.h>

#include "field_ros/map_messages.hpp"

namespace field_ros {

/// For each pair of fields named V_x and V_y an arrow (namespace "V") at about `per_side`
/// places along the longer side of the map, and at its tip the 90 % ellipse of the two (namespace
/// "V 90 %"). Arrows have the map's frame, so that a robot that heads along x would measure them;
/// nine of ten are at most as long as the distance between two. Places that are not known yet have
/// none. Ellipses follow the field's own uncertainty and that of a measurement (FieldPrediction).
/// O(cells drawn)
visualization_msgs::MarkerArray to_vector_markers(const PredictedGrid& map, int per_side = 24);

/// Appends what removes from rviz the markers of `before` that `now` does not have.
void delete_missing(const visualization_msgs::MarkerArray& before,
                    visualization_msgs::MarkerArray& now);

}  // namespace field_ros
