// Where a simulated robot drives: corner points, one after the other.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "field_core/params.hpp"
#include "field_core/random.hpp"

namespace field_bags {

enum class RouteKind { waypoints, lawn_mower, random_waypoints };

struct RouteParams {
  RouteKind kind = RouteKind::waypoints;
  std::vector<Eigen::Vector2d> waypoints;
  double spacing = 1.0;
  double margin = 1.0;

  template <class Visitor>
  void visit(Visitor& v) {
    v.required("kind").choice("kind", kind,
                              {{"waypoints", RouteKind::waypoints},
                               {"lawn_mower", RouteKind::lawn_mower},
                               {"random_waypoints", RouteKind::random_waypoints}},
                              "waypoints: a closed loop through the list, again and again (a "
                              "corridor loop); lawn_mower: lanes along x, then along y, and so on");
    v.points("waypoints", waypoints, "m", "the corners of the loop, for kind: waypoints");
    v.number("spacing", spacing, field_core::positive(), "m", "between lanes of the lawn mower");
    v.number("margin", margin, field_core::non_negative(), "m",
             "kept from the sides of the area by lawn_mower and random_waypoints");
  }
};

/// Corner points of a route at least `length` long; consecutive points differ.
/// @param area x_min, y_min, x_max, y_max [m]
/// @throws field_core::ParameterError if the area within the margin is empty, or a loop has fewer
/// than
///         two points, or two equal points follow each other
std::vector<Eigen::Vector2d> make_route(const RouteParams& params, const std::vector<double>& area,
                                        double length, field_core::Random& random);

}  // namespace field_bags
