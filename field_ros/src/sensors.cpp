#include "field_ros/sensors.hpp"

#include <cmath>
#include <limits>

namespace field_ros {
namespace {

field_msgs::FieldMeasurement single(const std_msgs::Header& header, const std::string& field,
                                    double value, double variance) {
  field_msgs::FieldMeasurement out;
  out.header = header;
  out.names = {field};
  out.values = {value};
  out.variances = {variance};
  return out;
}

}  // namespace

const char* sensor_datatype(SensorType type) {
  const char* name = "";
  with_sensor_message(type, [&name](auto* message) {
    name = ros::message_traits::datatype<std::remove_pointer_t<decltype(message)>>();
  });
  return name;
}

field_msgs::FieldMeasurement to_field(const sensor_msgs::Temperature& m, const std::string& field) {
  return single(m.header, field, m.temperature, m.variance);
}

field_msgs::FieldMeasurement to_field(const sensor_msgs::Illuminance& m, const std::string& field) {
  return single(m.header, field, m.illuminance, m.variance);
}

field_msgs::FieldMeasurement to_field(const sensor_msgs::RelativeHumidity& m,
                                      const std::string& field) {
  return single(m.header, field, m.relative_humidity, m.variance);
}

field_msgs::FieldMeasurement to_field(const sensor_msgs::FluidPressure& m,
                                      const std::string& field) {
  return single(m.header, field, m.fluid_pressure, m.variance);
}

field_msgs::FieldMeasurement to_field(const sensor_msgs::Range& m, const std::string& field) {
  const bool valid = m.range >= m.min_range && m.range <= m.max_range;
  return single(m.header, field, valid ? m.range : std::numeric_limits<double>::quiet_NaN(), 0.0);
}

field_msgs::FieldMeasurement to_field(const sensor_msgs::MagneticField& m,
                                      const std::string& field) {
  const auto& b = m.magnetic_field;
  const auto& c = m.magnetic_field_covariance;
  field_msgs::FieldMeasurement out;
  out.header = m.header;
  out.names = {field + "_x", field + "_y", field + "_z", field + "_norm"};
  out.values = {b.x, b.y, b.z, std::sqrt(b.x * b.x + b.y * b.y + b.z * b.z)};
  // A first element of -1 says "no covariance" in sensor_msgs.
  if (c[0] >= 0.0) out.variances = {c[0], c[4], c[8], 0.0};
  return out;
}

}  // namespace field_ros
