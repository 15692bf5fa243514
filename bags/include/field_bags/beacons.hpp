// Optical spots on a ceiling, seen by a bearing sensor: the world of Vector Field SLAM.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "field_bags/field_source.hpp"
#include "field_core/params.hpp"

namespace field_bags {

struct SpotParams {
  std::vector<double> position = {0.0, 0.0};

  template <class Visitor>
  void visit(Visitor& v) {
    v.required("position")
        .numbers("position", position, {2, 2}, field_core::any_number(), "m",
                 "place on the ceiling, in the map frame");
  }
};

struct BeaconParams {
  std::map<std::string, SpotParams> spots;
  double height = 2.5;
  double multipath = 0.0;
  double multipath_length = 1.0;
  std::vector<double> offset = {0.0, 0.0};
  double noise_stddev = 0.01;

  template <class Visitor>
  void visit(Visitor& v) {
    using field_core::positive;
    v.dictionary("spots", spots,
                 "by name; two spots of one projector give the 4 channels of the "
                 "paper; none: no beacons in this world");
    v.number("height", height, positive(), "m", "of the ceiling above the sensor");
    v.number("multipath", multipath, {0.0, 1.0}, "1",
             "weight of a reflection at the wall itself, relative to the direct light");
    v.number("multipath_length", multipath_length, positive(), "m",
             "distance from the wall over which that weight falls by e");
    v.numbers("offset", offset, {2, 2}, field_core::any_number(), "1",
              "c of the paper: a sensor that is not level (rotational variability)");
    v.number("noise_stddev", noise_stddev, field_core::non_negative(), "1", "of one coordinate");
  }
};

/// Channels `SPOT_x` and `SPOT_y`: the direction to the spot projected onto the sensor plane, in
/// the sensor's frame (Gutmann et al. 2010, eq. 45-47),
///   z = R(-yaw) m(p) + c,   m(p) = centroid over the direct light and its reflections of (s_k - p)
///   / h,
/// where s_0 is the spot with weight 1, and s_k its mirror image at side k of the area with weight
/// multipath exp(-(distance of p to side k) / multipath_length): linear in the middle of the room,
/// bent over near walls as in the paper's Fig. 4.
class Beacons : public FieldSource {
 public:
  /// @param area x_min, y_min, x_max, y_max of the room [m]
  Beacons(const BeaconParams& params, const std::vector<double>& area);
  void append(const field_core::SE2& sensor, std::vector<double>& values) const override;
  /// m(p) of one spot.
  Eigen::Vector2d direction(const Eigen::Vector2d& spot, const Eigen::Vector2d& place) const;

 private:
  BeaconParams params_;
  std::vector<double> area_;
};

}  // namespace field_bags
