// The magnetic field of iron things in the earth's field.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "field_bags/field_source.hpp"
#include "field_core/params.hpp"

namespace field_bags {

struct DipoleParams {
  std::vector<double> position = {0.0, 0.0, 0.0};
  std::vector<double> moment = {0.0, 0.0, 0.0};

  template <class Visitor>
  void visit(Visitor& v) {
    using field_core::any_number;
    v.required("position")
        .numbers("position", position, {3, 3}, any_number(), "m",
                 "in the map frame, z above the sensor");
    v.required("moment").numbers("moment", moment, {3, 3}, any_number(), "A m^2",
                                 "magnetic moment");
  }
};

struct MagneticParams {
  std::map<std::string, DipoleParams> dipoles;
  std::vector<double> earth_field = {20.0, 0.0, -45.0};
  std::vector<double> offset = {0.0, 0.0, 0.0};
  double noise_stddev = 0.3;

  template <class Visitor>
  void visit(Visitor& v) {
    using field_core::any_number;
    v.dictionary("dipoles", dipoles, "by name; none: no magnetometer in this world");
    v.numbers("earth_field", earth_field, {3, 3}, any_number(), "uT", "in the map frame, z up");
    v.numbers("offset", offset, {3, 3}, any_number(), "uT",
              "hard iron of the robot, in the sensor's frame, not calibrated away");
    v.number("noise_stddev", noise_stddev, field_core::non_negative(), "uT", "of one reading");
  }
};

/// Channels mag_x, mag_y, mag_z (sensor frame, offset included) and mag_norm (their norm, with a
/// noise of its own) [uT]. A dipole of moment m at displacement r from it gives, in the map frame,
///   B = mu0 / (4 pi) (3 (m . u) u - m) / |r|^3,  u = r / |r|  (Jackson 1999, eq. 5.56);
/// |r| below 0.2 m is taken as 0.2 m: a sensor does not enter the iron.
class MagneticDipoles : public FieldSource {
 public:
  explicit MagneticDipoles(const MagneticParams& params);
  void append(const field_core::SE2& sensor, std::vector<double>& values) const override;
  /// Field in the map frame. [uT]
  Eigen::Vector3d at(const Eigen::Vector2d& place) const;

 private:
  MagneticParams params_;
};

}  // namespace field_bags
