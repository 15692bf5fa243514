// Learned maps as files that other programs read: pure functions, text by file name.
#pragma once

#include <map>
#include <string>

#include "field_ros/map_messages.hpp"

namespace field_ros {

/// For each field the mean and, as FIELD_stddev, the standard deviation:
///
/// - field_NAME.pgm, .yaml: ROS's map_server, mode raw: it publishes what ~grid/NAME shows; the
///   YAML says which values 0 and 100 stand for
/// - field_NAME.asc: ESRI ASCII grid of the raw values (QGIS, GDAL); not known yet: NODATA
std::map<std::string, std::string> map_files(const PredictedGrid& map);

}  // namespace field_ros
