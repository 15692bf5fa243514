#include "field_ros/sensors.hpp"

#include <Eigen/Core>
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

field_msgs::FieldMeasurement to_field(const sensor_msgs::Temperature& m,
                                      const SensorParams& sensor) {
  return single(m.header, sensor.field, m.temperature, m.variance);
}

field_msgs::FieldMeasurement to_field(const sensor_msgs::Illuminance& m,
                                      const SensorParams& sensor) {
  return single(m.header, sensor.field, m.illuminance, m.variance);
}

field_msgs::FieldMeasurement to_field(const sensor_msgs::RelativeHumidity& m,
                                      const SensorParams& sensor) {
  return single(m.header, sensor.field, m.relative_humidity, m.variance);
}

field_msgs::FieldMeasurement to_field(const sensor_msgs::FluidPressure& m,
                                      const SensorParams& sensor) {
  return single(m.header, sensor.field, m.fluid_pressure, m.variance);
}

field_msgs::FieldMeasurement to_field(const sensor_msgs::Range& m, const SensorParams& sensor) {
  const bool valid = m.range >= m.min_range && m.range <= m.max_range;
  return single(m.header, sensor.field, valid ? m.range : std::numeric_limits<double>::quiet_NaN(),
                0.0);
}

field_msgs::FieldMeasurement to_field(const sensor_msgs::MagneticField& m,
                                      const SensorParams& sensor) {
  using Matrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const Eigen::Vector3d raw(m.magnetic_field.x, m.magnetic_field.y, m.magnetic_field.z);
  const Eigen::Map<const Eigen::Vector3d> offset(sensor.calibration.offset.data());
  const Eigen::Map<const Matrix> matrix(sensor.calibration.matrix.data());
  const Eigen::Vector3d b = matrix * (raw - offset);
  const std::string& field = sensor.field;
  field_msgs::FieldMeasurement out;
  out.header = m.header;
  out.names = {field + "_x", field + "_y", field + "_z", field + "_norm"};
  out.values = {b.x(), b.y(), b.z(), b.norm()};
  // A first element of -1 says "no covariance" in sensor_msgs.
  if (m.magnetic_field_covariance[0] >= 0.0) {
    const Eigen::Map<const Matrix> covariance(m.magnetic_field_covariance.data());
    const Eigen::Vector3d v = (matrix * covariance * matrix.transpose()).diagonal();
    out.variances = {v.x(), v.y(), v.z(), 0.0};
  }
  return out;
}

}  // namespace field_ros
