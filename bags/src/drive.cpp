#include "field_bags/drive.hpp"

#include <algorithm>
#include <cmath>

namespace field_bags {
namespace {
constexpr double kSharpestArc = 150.0 * M_PI / 180.0;
constexpr double kStraight = 1e-9;  // rad: no corner at all

double heading(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  return std::atan2(to.y() - from.y(), to.x() - from.x());
}
}  // namespace

Drive::Drive(const std::vector<Eigen::Vector2d>& route, const DriveParams& params) {
  pose_ = field_core::SE2(route[0].x(), route[0].y(), heading(route[0], route[1]));
  double used = 0.0;  // of this leg, by the arc of the corner behind
  for (std::size_t i = 0; i + 1 < route.size(); ++i) {
    const double leg = (route[i + 1] - route[i]).norm();
    if (i + 2 == route.size()) {
      line(leg - used, params.speed);
      break;
    }
    const double next_leg = (route[i + 2] - route[i + 1]).norm();
    const double corner = field_core::wrap_angle(heading(route[i + 1], route[i + 2]) -
                                                 heading(route[i], route[i + 1]));
    if (params.turning == Turning::in_place || std::abs(corner) > kSharpestArc) {
      line(leg - used, params.speed);
      turn(corner, params.turn_rate);
      used = 0.0;
      continue;
    }
    const double slope = std::tan(std::abs(corner) / 2);
    const double cut = std::min(params.arc_radius * slope, 0.5 * std::min(leg, next_leg));
    line(leg - used - cut, params.speed);
    if (std::abs(corner) > kStraight) arc(corner, cut / slope, params.speed);
    used = cut;
  }
}

void Drive::line(double length, double speed) {
  if (length > 0.0) add(speed, 0.0, length / speed);
}

void Drive::turn(double angle, double rate) {
  if (std::abs(angle) > kStraight) add(0.0, std::copysign(rate, angle), std::abs(angle) / rate);
}

void Drive::arc(double angle, double radius, double speed) {
  add(speed, std::copysign(speed / radius, angle), radius * std::abs(angle) / speed);
}

void Drive::add(double speed, double turn_rate, double seconds) {
  pieces_.push_back({end_, pose_, speed, turn_rate});
  pose_ = pose_ * field_core::SE2::exp({speed * seconds, 0.0, turn_rate * seconds});
  end_ += seconds;
}

field_core::SE2 Drive::at(double seconds) const {
  if (seconds >= end_) return pose_;
  const auto after =
      std::upper_bound(pieces_.begin(), pieces_.end(), seconds,
                       [](double time, const Piece& piece) { return time < piece.begin; });
  const Piece& piece = after == pieces_.begin() ? *after : *(after - 1);
  const double t = std::max(0.0, seconds - piece.begin);
  return piece.start * field_core::SE2::exp({piece.speed * t, 0.0, piece.turn_rate * t});
}

}  // namespace field_bags
