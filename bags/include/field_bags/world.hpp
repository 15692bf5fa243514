// The world file of field_simulate, and the world built from it.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "field_bags/beacons.hpp"
#include "field_bags/drive.hpp"
#include "field_bags/gp_field.hpp"
#include "field_bags/magnetic.hpp"
#include "field_bags/odometer.hpp"
#include "field_bags/route.hpp"
#include "field_bags/wifi.hpp"

namespace field_bags {

/// When and how well the sensor reads.
struct SensorParams {
  double rate = 1.0;
  std::vector<double> mounting = {0.0, 0.0, 0.0};
  double dropout_probability = 0.0;
  double outlier_probability = 0.0;
  double outlier_size = 10.0;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("rate", rate, {0.01, 200.0}, "Hz", "readings per second");
    v.numbers("mounting", mounting, {3, 3}, field_core::any_number(), "m, m, rad",
              "x, y, yaw of the sensor on the robot; published on /tf_static unless all zero");
    v.number("dropout_probability", dropout_probability, {0.0, 1.0}, "1",
             "that a channel is missing from a message");
    v.number("outlier_probability", outlier_probability, {0.0, 1.0}, "1",
             "that a reading gets a gross error");
    v.number("outlier_size", outlier_size, field_core::non_negative(), "1",
             "standard deviation of gross errors, in noise_stddev of the channel");
  }
};

/// Where a robot is seen from outside.
struct PositionParams {
  double rate = 0.0;
  double stddev = 1.0;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("rate", rate, {0.0, 200.0}, "Hz", "observations per second; 0: none");
    v.number("stddev", stddev, field_core::positive(), "m", "of each coordinate");
  }
};

/// One robot of a world.
struct RobotParams {
  RouteParams route;
  DriveParams drive;
  OdometerParams odometry;
  SensorParams sensor;
  PositionParams position;
  double joins = 0.0;
  double leaves = 0.0;

  template <class Visitor>
  void visit(Visitor& v) {
    v.group("route", route, "where the robot drives");
    v.group("drive", drive, "how it drives");
    v.group("odometry", odometry, "errors of its odometry");
    v.group("sensor", sensor, "its field sensor");
    v.group("position", position, "observations of its position from outside, like GPS");
    v.number("joins", joins, field_core::non_negative(), "s", "it is switched on then");
    v.number("leaves", leaves, field_core::non_negative(), "s",
             "it is switched off then; 0: at the end");
  }
  /// @throws field_core::ParameterError for what no single range can say
  void validate() const;
};

/// The members of RobotParams describe the only robot, if `robots` is empty.
struct WorldParams : RobotParams {
  double duration = 600.0;
  std::vector<double> area = {-10.0, -10.0, 10.0, 10.0};
  std::map<std::string, WallParams> walls;
  std::map<std::string, GpFieldParams> gp_fields;
  WifiParams wifi;
  BeaconParams beacons;
  MagneticParams magnetic;
  std::map<std::string, RobotParams> robots;

  template <class Visitor>
  void visit(Visitor& v) {
    v.required("duration").number("duration", duration, {1.0, 100000.0}, "s", "of the run");
    v.required("area").numbers("area", area, {4, 4}, field_core::any_number(), "m",
                               "x_min, y_min, x_max, y_max; its sides reflect the beacons' light");
    v.dictionary("walls", walls, "that weaken radio signals, by name");
    v.dictionary("gp_fields", gp_fields, "fields drawn from a Gaussian process, by name");
    v.group("wifi", wifi, "radio access points");
    v.group("beacons", beacons, "optical spots on the ceiling");
    v.group("magnetic", magnetic, "magnetic dipoles");
    RobotParams::visit(v);
    v.dictionary("robots", robots,
                 "several robots by name, each with a route, drive, ... of its own instead of the "
                 "above; their names become namespaces of topics and frames");
  }
  /// @throws field_core::ParameterError for what no single range can say
  void validate() const;
};

/// @throws field_core::DataError naming the file, and the line and key where there is one
WorldParams load_world(const std::string& path);

/// All field sources of a world; channels in the order gp_fields, wifi, beacons, magnetic.
class World {
 public:
  World(const WorldParams& params, std::uint64_t seed);
  const std::vector<Channel>& channels() const { return channels_; }
  /// Noise-free values of all channels.
  std::vector<double> values(const field_core::SE2& sensor) const;

 private:
  std::vector<std::unique_ptr<FieldSource>> sources_;
  std::vector<Channel> channels_;
};

}  // namespace field_bags
