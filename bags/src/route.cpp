#include "field_bags/route.hpp"

#include <algorithm>
#include <cmath>

#include "field_core/errors.hpp"

namespace field_bags {
namespace {

using Points = std::vector<Eigen::Vector2d>;
using field_core::ParameterError;

constexpr double kShortestLeg = 0.01;  // m: nearer points count as equal

double path_length(const Points& points) {
  double length = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i) length += (points[i] - points[i - 1]).norm();
  return length;
}

void append(Points& points, const Eigen::Vector2d& point) {
  if (points.empty() || (point - points.back()).norm() > kShortestLeg) points.push_back(point);
}

Points loop(const Points& corners, double length) {
  if (corners.size() < 2) {
    throw ParameterError("route/waypoints", "needs at least two points for kind: waypoints");
  }
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if ((corners[i] - corners[(i + 1) % corners.size()]).norm() <= kShortestLeg) {
      throw ParameterError("route/waypoints",
                           "point " + std::to_string(i + 1) +
                               " equals the next one; leave one of them out (the "
                               "loop closes by itself)");
    }
  }
  double lap = (corners.back() - corners.front()).norm() + path_length(corners);
  Points points;
  for (double driven = -lap; driven < length; driven += lap) {
    points.insert(points.end(), corners.begin(), corners.end());
  }
  return points;
}

/// One sweep from the corner where the robot stands: lanes along `axis`, from this side to the
/// other.
void sweep(Points& points, int axis, const Eigen::Vector2d& low, const Eigen::Vector2d& high,
           double spacing) {
  const int across = 1 - axis;
  Eigen::Vector2d at = points.back();
  const double from = at[across];
  const double to = from == low[across] ? high[across] : low[across];
  const int lanes = std::max(1, static_cast<int>(std::lround(std::abs(to - from) / spacing)));
  for (int lane = 0; lane <= lanes; ++lane) {
    at[across] = lane == lanes ? to : from + (to - from) * lane / lanes;
    append(points, at);
    at[axis] = at[axis] == low[axis] ? high[axis] : low[axis];
    append(points, at);
  }
}

}  // namespace

Points make_route(const RouteParams& params, const std::vector<double>& area, double length,
                  field_core::Random& random) {
  if (params.kind == RouteKind::waypoints) return loop(params.waypoints, length);
  const Eigen::Vector2d low(area[0] + params.margin, area[1] + params.margin);
  const Eigen::Vector2d high(area[2] - params.margin, area[3] - params.margin);
  if ((high - low).minCoeff() < 2 * kShortestLeg) {
    throw ParameterError("route/margin", "leaves nothing of the area; make it smaller");
  }
  Points points{low};
  for (int axis = 0; path_length(points) < length; axis = 1 - axis) {
    if (params.kind == RouteKind::lawn_mower) {
      sweep(points, axis, low, high, params.spacing);
    } else {
      const double x = random.uniform(low.x(), high.x());
      append(points, {x, random.uniform(low.y(), high.y())});
    }
  }
  return points;
}

}  // namespace field_bags
