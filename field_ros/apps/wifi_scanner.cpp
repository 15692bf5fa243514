// Publishes the signal of each WiFi access point as a field: /field, field_msgs/FieldMeasurement.
#include <ros/ros.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdio>
#include <iostream>
#include <memory>

#include "field_core/csv.hpp"
#include "field_core/errors.hpp"
#include "field_ros/program.hpp"
#include "field_ros/wifi_scan.hpp"

namespace {

struct Options {
  std::string interface = "wlan0";
  std::string file;
  std::string frame = "base_link";
  std::vector<std::string> names;
  bool only_named = false;
  double period_s = 2.0;
  bool once = false;
};

std::string output_of(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(::popen(command.c_str(), "r"), ::pclose);
  if (!pipe) throw field_core::DataError("cannot run '" + command + "'");
  std::string text;
  std::array<char, 4096> part{};
  while (const std::size_t n = std::fread(part.data(), 1, part.size(), pipe.get())) {
    text.append(part.data(), n);
  }
  return text;
}

std::string scan(const Options& options) {
  if (!options.file.empty()) return field_core::read_file(options.file);
  const auto legal = [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-'; };
  if (!std::all_of(options.interface.begin(), options.interface.end(), legal)) {
    throw field_core::DataError("'" + options.interface + "' is not the name of an interface");
  }
  return output_of("iw dev " + options.interface + " scan");
}

std::map<std::string, std::string> names_of(const Options& options) {
  std::map<std::string, std::string> names;
  for (const std::string& entry : options.names) {
    const std::size_t equals = entry.find('=');
    if (equals == std::string::npos) {
      throw field_core::DataError("--name " + entry + ": write BSSID=NAME");
    }
    names[entry.substr(0, equals)] = entry.substr(equals + 1);
  }
  return names;
}

int publish(const Options& options) {
  const auto names = names_of(options);
  ros::NodeHandle handle;
  auto publisher = handle.advertise<field_msgs::FieldMeasurement>("field", 10, options.once);
  while (ros::ok()) {
    const ros::Time begin = ros::Time::now();
    auto measurement =
        field_ros::to_field(field_ros::parse_iw_scan(scan(options)), names, options.only_named);
    // A scan goes through the channels one after the other: its middle is the time it belongs to.
    measurement.header.stamp = begin + (ros::Time::now() - begin) * 0.5;
    measurement.header.frame_id = options.frame;
    if (measurement.names.empty()) {
      ROS_WARN_THROTTLE(10.0, "the scan shows no access point; 'iw dev %s scan' needs root rights",
                        options.interface.c_str());
    } else {
      publisher.publish(measurement);
    }
    if (options.once) break;
    ros::WallDuration(options.period_s).sleep();
    ros::spinOnce();
  }
  if (options.once) ros::spin();  // latched: for whoever comes
  return field_ros::kExitOk;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app(
      "Scans for WiFi access points with iw and publishes their signals [dBm] on 'field'.");
  app.add_option("--interface", options.interface, "network interface")->capture_default_str();
  app.add_option("--file", options.file, "output of 'iw dev ... scan' to read instead of scanning");
  app.add_option("--frame", options.frame, "header.frame_id: where the antenna is")
      ->capture_default_str();
  app.add_option("--name", options.names,
                 "BSSID=NAME of a field; may be repeated (else ap_<bssid>)");
  app.add_flag("--only-named", options.only_named, "leave out access points without a --name");
  app.add_option("--period", options.period_s, "pause between scans [s]")->capture_default_str();
  app.add_flag("--once", options.once, "one scan, latched");
  std::vector<std::string> arguments;
  ros::removeROSArgs(argc, argv, arguments);
  try {
    std::vector<std::string> reversed(arguments.rbegin(), arguments.rend() - 1);
    app.parse(reversed);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? field_ros::kExitOk : field_ros::kExitBadArguments;
  }
  return field_ros::run_guarded([&] {
    if (!options.file.empty()) (void)scan(options);  // before anything is advertised
    ros::init(argc, argv, "wifi_scanner");
    return publish(options);
  });
}
