// Received signal strength of radio access points behind walls.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "field_bags/field_source.hpp"
#include "field_bags/gp_field.hpp"
#include "field_core/params.hpp"

namespace field_bags {

/// A wall along a polyline.
struct WallParams {
  std::vector<Eigen::Vector2d> points;
  double attenuation = 5.0;

  template <class Visitor>
  void visit(Visitor& v) {
    v.required("points").points("points", points, "m", "corners of the wall, at least two");
    v.number("attenuation", attenuation, field_core::non_negative(), "dB", "per crossing");
  }
};

struct AccessPointParams {
  std::vector<double> position = {0.0, 0.0};
  double power = -35.0;

  template <class Visitor>
  void visit(Visitor& v) {
    v.required("position")
        .numbers("position", position, {2, 2}, field_core::any_number(), "m",
                 "place in the map frame");
    v.number("power", power, field_core::any_number(), "dBm", "received at 1 m");
  }
};

struct WifiParams {
  std::map<std::string, AccessPointParams> access_points;
  double path_loss_exponent = 2.5;
  double shadowing_stddev = 0.0;
  double shadowing_length = 3.0;
  double floor = -95.0;
  double noise_stddev = 2.0;

  template <class Visitor>
  void visit(Visitor& v) {
    using field_core::positive;
    v.dictionary("access_points", access_points, "by name; none: no radio in this world");
    v.number("path_loss_exponent", path_loss_exponent, {1.0, 6.0}, "1", "2 in free space");
    v.number("shadowing_stddev", shadowing_stddev, field_core::non_negative(), "dB",
             "unmodelled obstacles: a smooth random field per access point, fixed in space");
    v.number("shadowing_length", shadowing_length, positive(), "m", "length scale of shadowing");
    v.number("floor", floor, field_core::any_number(), "dBm", "weaker signals are not heard");
    v.number("noise_stddev", noise_stddev, field_core::non_negative(), "dB", "of one reading");
  }
};

/// How often the straight line from a to b crosses a wall. Touching an end counts once per wall
/// segment on one side only (half-open), so that a path through a corner of two segments counts 1.
int wall_crossings(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const WallParams& wall);

/// Log-distance path loss (Rappaport 2002, eq. 4.69a) with walls:
///   power - 10 n log10(max(d, 1 m) / 1 m) - sum of walls crossed + shadowing
class AccessPoints : public FieldSource {
 public:
  AccessPoints(const WifiParams& params, const std::map<std::string, WallParams>& walls,
               std::uint64_t seed);
  void append(const field_core::SE2& sensor, std::vector<double>& values) const override;

 private:
  WifiParams params_;
  std::map<std::string, WallParams> walls_;
  std::vector<GpDraw> shadowing_;  ///< one per access point, or none
};

}  // namespace field_bags
