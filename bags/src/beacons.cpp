#include "field_bags/beacons.hpp"

#include <cmath>

namespace field_bags {

Beacons::Beacons(const BeaconParams& params, const std::vector<double>& area)
    : params_(params), area_(area) {
  for (const auto& [name, spot] : params_.spots) {
    channels_.push_back({name + "_x", params_.noise_stddev});
    channels_.push_back({name + "_y", params_.noise_stddev});
  }
}

Eigen::Vector2d Beacons::direction(const Eigen::Vector2d& spot,
                                   const Eigen::Vector2d& place) const {
  Eigen::Vector2d sum = spot - place;
  double weights = 1.0;
  for (int side = 0; side < 4; ++side) {
    const int axis = side % 2;
    const double wall = area_[side];
    Eigen::Vector2d image = spot;
    image[axis] = 2.0 * wall - spot[axis];
    const double weight =
        params_.multipath * std::exp(-std::abs(place[axis] - wall) / params_.multipath_length);
    sum += weight * (image - place);
    weights += weight;
  }
  return sum / (weights * params_.height);
}

void Beacons::append(const field_core::SE2& sensor, std::vector<double>& values) const {
  for (const auto& [name, spot] : params_.spots) {
    const Eigen::Vector2d m = direction({spot.position[0], spot.position[1]}, sensor.translation());
    const Eigen::Vector2d seen = sensor.rotation().transpose() * m;
    values.push_back(seen.x() + params_.offset[0]);
    values.push_back(seen.y() + params_.offset[1]);
  }
}

}  // namespace field_bags
