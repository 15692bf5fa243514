#include "field_rviz_plugins/field_image.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace field_rviz_plugins {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Range {
  double low = kInfinity, high = -kInfinity;
  void include(double value) {
    if (!std::isfinite(value)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  /// 0 at the low end, 1 at the high one; 0 if there is no width.
  double position(double value) const { return high > low ? (value - low) / (high - low) : 0.0; }
};

std::vector<double> stddevs(const field_msgs::FieldMap& map) {
  std::vector<double> out;
  out.reserve(map.variance.size());
  for (const float variance : map.variance) {
    out.push_back(std::sqrt(std::max(0.0, static_cast<double>(variance))));
  }
  return out;
}

Range automatic_range(const std::vector<double>& values, const std::vector<double>& stddev,
                      const Range& uncertainty, const ImageOptions& options) {
  Range range;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const bool known = uncertainty.position(stddev[i]) <= 0.5;
    if (options.quantity == Quantity::stddev || known) range.include(values[i]);
  }
  if (range.low > range.high) return {0.0, 0.0};
  if (options.colours == ColourMap::diverging) {
    const double most = std::max(std::abs(range.low), std::abs(range.high));
    return {-most, most};
  }
  return range;
}

}  // namespace

bool is_complete(const field_msgs::FieldMap& map) {
  const std::size_t cells = std::size_t{map.info.width} * map.info.height;
  return cells > 0 && map.mean.size() == cells && map.variance.size() == cells &&
         map.info.resolution > 0.0F;
}

FieldImage draw(const field_msgs::FieldMap& map, const ImageOptions& options) {
  const std::vector<double> stddev = stddevs(map);
  std::vector<double> values(map.mean.begin(), map.mean.end());
  if (options.quantity == Quantity::stddev) values = stddev;
  Range uncertainty;
  for (const double s : stddev) uncertainty.include(s);
  Range range{options.low, options.high};
  if (options.automatic_range) range = automatic_range(values, stddev, uncertainty, options);
  FieldImage image{static_cast<int>(map.info.width),
                   static_cast<int>(map.info.height),
                   range.low,
                   range.high,
                   {}};
  image.rgba.reserve(4 * values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const bool finite = std::isfinite(values[i]) && std::isfinite(stddev[i]);
    const Rgb rgb = colour(options.colours, finite ? range.position(values[i])
                                                   : std::numeric_limits<double>::quiet_NaN());
    const double unknown = finite ? uncertainty.position(stddev[i]) : 1.0;
    const double alpha =
        std::clamp(options.opacity * (1.0 - options.fade_unknown * unknown), 0.0, 1.0);
    image.rgba.insert(image.rgba.end(), rgb.begin(), rgb.end());
    image.rgba.push_back(static_cast<std::uint8_t>(std::lround(255.0 * alpha)));
  }
  return image;
}

}  // namespace field_rviz_plugins
