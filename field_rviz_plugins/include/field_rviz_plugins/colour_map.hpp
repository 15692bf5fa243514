// Colours of values: pure, without rviz.
#pragma once

#include <array>
#include <cstdint>

namespace field_rviz_plugins {

using Rgb = std::array<std::uint8_t, 3>;

enum class ColourMap {
  sequential,  ///< viridis: equal steps of the value look equally far apart, also in grey
  diverging    ///< coolwarm (Moreland 2009): sign by hue, magnitude by saturation
};

/// @param position 0 (lowest value) to 1 (highest); outside it is clamped, NaN is grey
Rgb colour(ColourMap map, double position);

}  // namespace field_rviz_plugins
