#include "field_bags/magnetic.hpp"

#include <algorithm>

namespace field_bags {
namespace {
constexpr double kMu0Over4Pi = 0.1;  // uT m^3 / (A m^2)
constexpr double kNearest = 0.2;     // m

Eigen::Vector3d vector3(const std::vector<double>& v) { return {v[0], v[1], v[2]}; }
}  // namespace

MagneticDipoles::MagneticDipoles(const MagneticParams& params) : params_(params) {
  if (params_.dipoles.empty()) return;
  for (const char* name : {"mag_x", "mag_y", "mag_z", "mag_norm"}) {
    channels_.push_back({name, params_.noise_stddev});
  }
}

Eigen::Vector3d MagneticDipoles::at(const Eigen::Vector2d& place) const {
  Eigen::Vector3d field = vector3(params_.earth_field);
  for (const auto& [name, dipole] : params_.dipoles) {
    const Eigen::Vector3d moment = vector3(dipole.moment);
    const Eigen::Vector3d r = Eigen::Vector3d(place.x(), place.y(), 0.0) - vector3(dipole.position);
    const double distance = std::max(r.norm(), kNearest);
    const Eigen::Vector3d u = r / distance;
    field += kMu0Over4Pi / (distance * distance * distance) * (3.0 * moment.dot(u) * u - moment);
  }
  return field;
}

void MagneticDipoles::append(const field_core::SE2& sensor, std::vector<double>& values) const {
  if (params_.dipoles.empty()) return;
  Eigen::Vector3d seen = at(sensor.translation());
  seen.head<2>() = (sensor.rotation().transpose() * seen.head<2>()).eval();
  seen += vector3(params_.offset);
  for (int i = 0; i < 3; ++i) values.push_back(seen[i]);
  values.push_back(seen.norm());
}

}  // namespace field_bags
