#include "field_bags/wifi.hpp"

#include <algorithm>
#include <cmath>

namespace field_bags {
namespace {

/// Twice the signed area of the triangle a, b, c: positive if c is to the left of a -> b.
double side(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

}  // namespace

int wall_crossings(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const WallParams& wall) {
  int crossings = 0;
  for (std::size_t i = 1; i < wall.points.size(); ++i) {
    const Eigen::Vector2d &p = wall.points[i - 1], &q = wall.points[i];
    const bool wall_straddles = (side(a, b, p) > 0) != (side(a, b, q) > 0);
    const bool ray_straddles = (side(p, q, a) > 0) != (side(p, q, b) > 0);
    if (wall_straddles && ray_straddles) ++crossings;
  }
  return crossings;
}

AccessPoints::AccessPoints(const WifiParams& params, const std::map<std::string, WallParams>& walls,
                           std::uint64_t seed)
    : params_(params), walls_(walls) {
  for (const auto& [name, access_point] : params_.access_points) {
    channels_.push_back({name, params_.noise_stddev, params_.floor});
    if (params_.shadowing_stddev == 0.0) continue;
    const field_core::Kernel kernel(field_core::KernelType::squared_exponential,
                                    params_.shadowing_stddev,
                                    Eigen::Vector2d::Constant(params_.shadowing_length));
    field_core::Random random = random_stream(seed, "shadowing/" + name);
    shadowing_.emplace_back(kernel, random);
  }
}

void AccessPoints::append(const field_core::SE2& sensor, std::vector<double>& values) const {
  const Eigen::Vector2d here = sensor.translation();
  std::size_t index = 0;
  for (const auto& [name, access_point] : params_.access_points) {
    const Eigen::Vector2d there(access_point.position[0], access_point.position[1]);
    const double distance = std::max((there - here).norm(), 1.0);
    double power = access_point.power - 10.0 * params_.path_loss_exponent * std::log10(distance);
    for (const auto& [wall_name, wall] : walls_) {
      power -= wall.attenuation * wall_crossings(there, here, wall);
    }
    if (!shadowing_.empty()) power += shadowing_[index](here);
    values.push_back(power);
    ++index;
  }
}

}  // namespace field_bags
