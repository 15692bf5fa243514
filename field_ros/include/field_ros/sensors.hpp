// Standard sensor messages as measurements of fields.
#pragma once

#include <field_msgs/FieldMeasurement.h>
#include <sensor_msgs/FluidPressure.h>
#include <sensor_msgs/Illuminance.h>
#include <sensor_msgs/MagneticField.h>
#include <sensor_msgs/Range.h>
#include <sensor_msgs/RelativeHumidity.h>
#include <sensor_msgs/Temperature.h>

#include <string>

#include "field_ros/sensor_params.hpp"

namespace field_ros {

/// ROS type of a sensor, such as "sensor_msgs/Temperature".
const char* sensor_datatype(SensorType type);

/// The message's value as the sensor's field, its variance (0: the configured noise) and its
/// header.
field_msgs::FieldMeasurement to_field(const sensor_msgs::Temperature& m,
                                      const SensorParams& sensor);
field_msgs::FieldMeasurement to_field(const sensor_msgs::Illuminance& m,
                                      const SensorParams& sensor);
field_msgs::FieldMeasurement to_field(const sensor_msgs::RelativeHumidity& m,
                                      const SensorParams& sensor);
field_msgs::FieldMeasurement to_field(const sensor_msgs::FluidPressure& m,
                                      const SensorParams& sensor);
/// A range outside [min_range, max_range] is not observed (NaN).
field_msgs::FieldMeasurement to_field(const sensor_msgs::Range& m, const SensorParams& sensor);
/// FIELD_x, _y, _z in the sensor's frame [T], calibrated, and FIELD_norm, which does not depend
/// on the heading.
field_msgs::FieldMeasurement to_field(const sensor_msgs::MagneticField& m,
                                      const SensorParams& sensor);

/// Calls `visit` with a null pointer of the message type that belongs to `type`.
template <class Visit>
void with_sensor_message(SensorType type, Visit visit) {
  switch (type) {
    case SensorType::magnetic_field:
      return visit(static_cast<sensor_msgs::MagneticField*>(nullptr));
    case SensorType::temperature:
      return visit(static_cast<sensor_msgs::Temperature*>(nullptr));
    case SensorType::illuminance:
      return visit(static_cast<sensor_msgs::Illuminance*>(nullptr));
    case SensorType::relative_humidity:
      return visit(static_cast<sensor_msgs::RelativeHumidity*>(nullptr));
    case SensorType::fluid_pressure:
      return visit(static_cast<sensor_msgs::FluidPressure*>(nullptr));
    case SensorType::range:
      return visit(static_cast<sensor_msgs::Range*>(nullptr));
  }
}

}  // namespace field_ros
