// Messages and places that several tests need.
#pragma once

#include <field_msgs/FieldMeasurement.h>
#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "field_ros/convert.hpp"

namespace field_ros_test {

/// A directory that lives as long as the test.
class TemporaryDirectory {
 public:
  TemporaryDirectory() {
    std::string name = (std::filesystem::temp_directory_path() / "field_ros_test_XXXXXX").string();
    path_ = ::mkdtemp(name.data());
  }
  ~TemporaryDirectory() { std::filesystem::remove_all(path_); }
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

inline std::string read_file(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

inline void write_file(const std::string& path, const std::string& text) {
  std::ofstream(path) << text;
}

inline nav_msgs::Odometry odometry(double stamp_s, double x, double y = 0.0, double yaw = 0.0) {
  nav_msgs::Odometry message;
  message.header.stamp = ros::Time(stamp_s);
  message.header.frame_id = "odom";
  message.child_frame_id = "base_link";
  message.pose.pose = field_ros::to_pose(field_core::SE2(x, y, yaw));
  return message;
}

inline field_msgs::FieldMeasurement measurement(double stamp_s, double value,
                                                const std::string& name = "light") {
  field_msgs::FieldMeasurement message;
  message.header.stamp = ros::Time(stamp_s);
  message.header.frame_id = "base_link";
  message.names = {name};
  message.values = {value};
  return message;
}

/// The text of the exception that `body` throws; a failure if it throws none.
template <class Body>
std::string error_of(Body body) {
  try {
    body();
  } catch (const std::exception& e) {
    return e.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return "";
}

}  // namespace field_ros_test
