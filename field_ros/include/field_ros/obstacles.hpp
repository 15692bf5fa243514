// Occupancy grids (map_server's /map) for estimators whose fields do not pass walls.
#pragma once

#include <nav_msgs/OccupancyGrid.h>

#include <string>

#include "field_core/occupancy_mask.hpp"
#include "field_ros/any_estimator.hpp"

namespace field_ros {

/// Cells from this value on are walls, as map_server's occupied_thresh has it; unknown ones (-1)
/// are none.
constexpr int kOccupiedValue = 65;

/// @throws DataError saying what cannot be used: another frame than the map's, cells that are not
/// width x height, a resolution that is not positive, an origin that is not finite or not level
field_core::OccupancyMask to_mask(const nav_msgs::OccupancyGrid& map,
                                  const std::string& global_frame);

/// Live, when `use_map_topic` is set: waits for a map that can be used on the topic `map`, and says
/// so; what cannot be used is logged. Returns at once otherwise, and when ROS shuts down.
void await_obstacles(Configured& configured);

}  // namespace field_ros
