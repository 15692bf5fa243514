#include "field_ros/any_estimator.hpp"

#include <cctype>
#include <cmath>

#include "field_ros/field_grid.hpp"
#include "field_ros/robot_interface.hpp"

namespace field_ros {

void check_configured(const Configured& configured) {
  using field_core::ParameterError;
  const auto legal = [](unsigned char c) { return std::isalnum(c) || c == '_'; };
  for (const auto& field : configured.estimator->fields()) {
    bool ok = !field.name.empty() && std::isalpha(static_cast<unsigned char>(field.name[0]));
    for (const char c : field.name) ok = ok && legal(static_cast<unsigned char>(c));
    if (!ok) {
      throw ParameterError("fields/" + field.name,
                           "a field's name becomes a topic and a file; begin with a letter and use "
                           "letters, digits and '_' only");
    }
  }
  if (configured.node.use_map_topic && !configured.estimator->uses_obstacles()) {
    throw ParameterError("use_map_topic", std::string("fields of ") + configured.estimator->name() +
                                              " know no walls; set it to false, or use gmrf_slap");
  }
  robot_interfaces(configured.node, configured.estimator->robots());
  const field_core::MapRegion region = configured.estimator->map_region();
  const double resolution = configured.node.map_resolution;
  const double cells = (std::ceil((region.x_max - region.x_min) / resolution)) *
                       (std::ceil((region.y_max - region.y_min) / resolution));
  if (!(cells <= kLargestGrid)) {
    throw ParameterError("map_resolution", field_core::format_number(resolution) +
                                               " m gives a map of " +
                                               field_core::format_number(cells) +
                                               " cells; choose a coarser one, below " +
                                               field_core::format_number(kLargestGrid) + " cells");
  }
}

}  // namespace field_ros
