// A field map as an image: pure, without rviz.
#pragma once

#include <field_msgs/FieldMap.h>

#include <cstdint>
#include <vector>

#include "field_rviz_plugins/colour_map.hpp"

namespace field_rviz_plugins {

enum class Quantity { mean, stddev };

struct ImageOptions {
  Quantity quantity = Quantity::mean;
  ColourMap colours = ColourMap::sequential;
  bool automatic_range = true;  ///< false: low and high are the given ones
  double low = 0.0, high = 1.0;
  double opacity = 1.0;  ///< of the best known cell, 0 to 1
  /// How much of its opacity the least known cell loses, 0 to 1; in between by the standard
  /// deviation.
  double fade_unknown = 0.0;
};

/// Row-major from the lower left cell as in FieldMap; red, green, blue, alpha.
struct FieldImage {
  int width = 0, height = 0;
  double low = 0.0, high = 0.0;  ///< values of the ends of the colour map
  std::vector<std::uint8_t> rgba;
};

/// True if width * height cells have a mean and a variance, as FieldMap says.
bool is_complete(const field_msgs::FieldMap& map);

/// The automatic range spans the values of the better known half of what the map tells apart (cells
/// whose standard deviation is below the middle between the smallest and the largest); of the
/// diverging map it is symmetric about 0. @param map is_complete()
FieldImage draw(const field_msgs::FieldMap& map, const ImageOptions& options);

}  // namespace field_rviz_plugins
