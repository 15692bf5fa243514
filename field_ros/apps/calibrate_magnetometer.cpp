// Hard and soft iron of a magnetometer from a bag in which it is turned where the field is
// constant.
#include <sensor_msgs/MagneticField.h>

#include <CLI/CLI.hpp>
#include <iostream>

#include "field_core/csv.hpp"
#include "field_core/errors.hpp"
#include "field_ros/bag_input.hpp"
#include "field_ros/ellipsoid_fit.hpp"
#include "field_ros/program.hpp"

namespace {

using field_core::format_number;

Eigen::Matrix3Xd read_readings(const std::string& path, const std::string& topic) {
  const field_ros::BagInput input(path);
  input.require(topic, {"sensor_msgs/MagneticField"});
  std::vector<Eigen::Vector3d> found;
  input.read({topic}, [&](const rosbag::MessageInstance& instance, double) {
    const auto message = instance.instantiate<sensor_msgs::MagneticField>();
    if (!message) {
      throw field_core::DataError(path + ": topic '" + topic +
                                  "': its messages have another md5sum");
    }
    const auto& b = message->magnetic_field;
    const Eigen::Vector3d reading(b.x, b.y, b.z);
    if (reading.allFinite()) found.push_back(reading);
  });
  Eigen::Matrix3Xd readings(3, static_cast<Eigen::Index>(found.size()));
  for (std::size_t i = 0; i < found.size(); ++i) {
    readings.col(static_cast<Eigen::Index>(i)) = found[i];
  }
  return readings;
}

// As the node reads it: sensors/<name>/calibration.
std::string to_yaml(const field_ros::MagnetometerCalibration& c, Eigen::Index readings) {
  std::string text = "# calibrated = matrix * (raw - offset), fitted to " +
                     std::to_string(readings) + " readings\n# spread of the magnitude: raw " +
                     format_number(c.raw_residual) + " T, calibrated " + format_number(c.residual) +
                     " T, of " + format_number(c.field) + " T\ncalibration:\n  offset: [";
  for (int i = 0; i < 3; ++i) text += (i > 0 ? ", " : "") + format_number(c.offset(i));
  text += "]\n  matrix: [";
  for (int i = 0; i < 9; ++i) {
    if (i > 0) text += i % 3 == 0 ? ",\n           " : ", ";
    text += format_number(c.matrix(i / 3, i % 3));
  }
  return text + "]\n";
}

}  // namespace

int main(int argc, char** argv) {
  std::string bag, topic = "/magnetic_field", output;
  bool planar = false;
  CLI::App app(
      "Fits hard iron (offset) and soft iron (matrix) to the readings of a magnetometer that is "
      "turned at one place.");
  app.add_option("--bag", bag, "bag to read")->required();
  app.add_option("--topic", topic, "sensor_msgs/MagneticField")->capture_default_str();
  app.add_option("--output", output, "YAML to write; default: standard output");
  app.add_flag("--planar", planar, "it was turned about z only: x and y are calibrated");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? field_ros::kExitOk : field_ros::kExitBadArguments;
  }
  return field_ros::run_guarded([&] {
    const Eigen::Matrix3Xd readings = read_readings(bag, topic);
    const auto calibration =
        planar ? field_ros::fit_ellipse(readings) : field_ros::fit_ellipsoid(readings);
    const std::string text = to_yaml(calibration, readings.cols());
    if (output.empty()) {
      std::cout << text;
    } else {
      field_core::write_file_atomically(output, text);
    }
    return field_ros::kExitOk;
  });
}
