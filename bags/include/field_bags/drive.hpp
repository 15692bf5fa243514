// The true motion of a simulated robot: a unicycle that follows corner points.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "field_core/params.hpp"
#include "field_core/se2.hpp"

namespace field_bags {

enum class Turning { in_place, arcs };

struct DriveParams {
  double speed = 0.5;
  Turning turning = Turning::in_place;
  double turn_rate = 0.8;
  double arc_radius = 0.5;

  template <class Visitor>
  void visit(Visitor& v) {
    using field_core::positive;
    v.number("speed", speed, positive(), "m/s", "along the route");
    v.choice("turning", turning, {{"in_place", Turning::in_place}, {"arcs", Turning::arcs}},
             "in_place: stops at a corner and turns; arcs: rounds it at full speed");
    v.number("turn_rate", turn_rate, positive(), "rad/s", "when turning in place");
    v.number("arc_radius", arc_radius, positive(), "m",
             "of rounded corners; less where legs are too short, and corners sharper than 150 "
             "degrees are turned in place");
  }
};

/// Pieces of constant (v, omega): lines, turns and arcs. Starts at the first point, facing the
/// second.
class Drive {
 public:
  /// @param route at least two points, consecutive ones distinct
  Drive(const std::vector<Eigen::Vector2d>& route, const DriveParams& params);

  /// True pose at a time after the start; the last pose after the end. O(log pieces).
  field_core::SE2 at(double seconds) const;
  double duration() const { return end_; }  ///< [s]

 private:
  struct Piece {
    double begin;  ///< [s]
    field_core::SE2 start;
    double speed, turn_rate;
  };
  void line(double length, double speed);
  void turn(double angle, double rate);
  void arc(double angle, double radius, double speed);
  void add(double speed, double turn_rate, double seconds);

  std::vector<Piece> pieces_;
  field_core::SE2 pose_;  ///< at the end of the last piece
  double end_ = 0.0;
};

}  // namespace field_bags
