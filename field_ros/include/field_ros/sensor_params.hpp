// Standard sensors as fields: which topic is which field.
#pragma once

#include <string>
#include <vector>

#include "field_core/errors.hpp"
#include "field_core/params.hpp"

namespace field_ros {

enum class SensorType {
  magnetic_field,
  temperature,
  illuminance,
  relative_humidity,
  fluid_pressure,
  range
};

/// calibrated = matrix * (raw - offset), as `calibrate_magnetometer` prints it.
struct MagnetometerParams {
  std::vector<double> offset{0.0, 0.0, 0.0};
  std::vector<double> matrix{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};

  template <class Visitor>
  void visit(Visitor& v) {
    v.numbers("offset", offset, {3, 3}, {}, "T", "hard iron: what is subtracted from x, y, z");
    v.numbers("matrix", matrix, {9, 9}, {}, "1", "soft iron: three rows, one after the other");
  }
};

/// A standard sensor whose values are fields, without a converter node.
struct SensorParams {
  SensorType type = SensorType::temperature;
  std::string topic;
  std::string field;
  MagnetometerParams calibration;

  template <class Visitor>
  void visit(Visitor& v) {
    v.required("type").choice("type", type,
                              {{"magnetic_field", SensorType::magnetic_field},
                               {"temperature", SensorType::temperature},
                               {"illuminance", SensorType::illuminance},
                               {"relative_humidity", SensorType::relative_humidity},
                               {"fluid_pressure", SensorType::fluid_pressure},
                               {"range", SensorType::range}},
                              "sensor_msgs type of the topic");
    v.required("topic").text("topic", topic, "topic of the sensor");
    v.required("field").text(
        "field", field,
        "field that its values are; magnetic_field: four of this name with _x, _y, _z "
        "and _norm behind it");
    v.group("calibration", calibration,
            "magnetic_field: hard and soft iron, from calibrate_magnetometer");
  }
  void validate() const {
    if (topic.empty())
      throw field_core::ParameterError("topic", "is empty; name the sensor's topic");
    if (field.empty())
      throw field_core::ParameterError("field", "is empty; name a configured field");
  }
};

}  // namespace field_ros
