#include "field_bags/world.hpp"

#include <algorithm>
#include <cctype>
#include <set>

#include "field_core/errors.hpp"

namespace field_bags {

using field_core::ParameterError;

void WorldParams::validate() const {
  if (!(area[0] < area[2] && area[1] < area[3])) {
    throw ParameterError("area", "must be x_min, y_min, x_max, y_max with min < max");
  }
  for (const auto& [name, wall] : walls) {
    if (wall.points.size() < 2) {
      throw ParameterError("walls/" + name + "/points", "needs at least two points");
    }
  }
  if (gp_fields.empty() && wifi.access_points.empty() && beacons.spots.empty() &&
      magnetic.dipoles.empty()) {
    throw ParameterError("gp_fields",
                         "this world has no field; give at least one entry of "
                         "gp_fields, wifi/access_points, beacons/spots or "
                         "magnetic/dipoles");
  }
  if (robots.empty()) RobotParams::validate();
  for (const auto& entry : robots) {
    const auto legal = [](unsigned char c) { return std::isalnum(c) || c == '_'; };
    const std::string& name = entry.first;
    if (std::isalpha(static_cast<unsigned char>(name[0])) &&
        std::all_of(name.begin(), name.end(), legal)) {
      continue;
    }
    throw ParameterError("robots/" + name,
                         "becomes topics and frames; begin with a letter and use letters, digits "
                         "and '_' only");
  }
}

void RobotParams::validate() const {
  if (route.kind == RouteKind::waypoints && route.waypoints.size() < 2) {
    throw ParameterError("route/waypoints", "needs at least two points for kind: waypoints");
  }
  if (leaves > 0.0 && leaves <= joins) {
    throw ParameterError("leaves", "must be later than joins, or 0");
  }
}

World::World(const WorldParams& params, std::uint64_t seed) {
  sources_.push_back(std::make_unique<GpFields>(params.gp_fields, seed));
  sources_.push_back(std::make_unique<AccessPoints>(params.wifi, params.walls, seed));
  sources_.push_back(std::make_unique<Beacons>(params.beacons, params.area));
  sources_.push_back(std::make_unique<MagneticDipoles>(params.magnetic));
  std::set<std::string> names;
  for (const auto& source : sources_) {
    for (const Channel& channel : source->channels()) {
      if (!names.insert(channel.name).second) {
        throw ParameterError(channel.name, "two fields of this world have this name; rename one");
      }
      channels_.push_back(channel);
    }
  }
}

std::vector<double> World::values(const field_core::SE2& sensor) const {
  std::vector<double> values;
  values.reserve(channels_.size());
  for (const auto& source : sources_) source->append(sensor, values);
  return values;
}

}  // namespace field_bags
