// Prints a topic of poses in a bag as CSV.
#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <geometry_msgs/TransformStamped.h>
#include <nav_msgs/Odometry.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <string>

#include "field_core/csv.hpp"
#include "field_core/errors.hpp"
#include "field_core/trajectory.hpp"
#include "field_ros/bag_input.hpp"
#include "field_ros/convert.hpp"
#include "field_ros/program.hpp"

namespace {

using field_core::format_number;
using field_core::SE2;

const char* const kPlainHeader = "stamp_s,x_m,y_m,yaw_rad\n";

std::string plain_line(const ros::Time& stamp, const SE2& pose) {
  return field_core::format_stamp(field_ros::from_ros(stamp)) + "," + format_number(pose.x()) +
         "," + format_number(pose.y()) + "," + format_number(pose.yaw()) + "\n";
}

std::string lines_of(const rosbag::MessageInstance& instance) {
  using field_ros::from_pose;
  if (const auto m = instance.instantiate<nav_msgs::Odometry>()) {
    return plain_line(m->header.stamp, from_pose(m->pose.pose));
  }
  if (const auto m = instance.instantiate<geometry_msgs::PoseStamped>()) {
    return plain_line(m->header.stamp, from_pose(m->pose));
  }
  if (const auto m = instance.instantiate<geometry_msgs::TransformStamped>()) {
    return plain_line(m->header.stamp, field_ros::from_transform(m->transform));
  }
  if (const auto m = instance.instantiate<geometry_msgs::PoseWithCovarianceStamped>()) {
    std::string line =
        field_core::estimate_csv_line(field_ros::from_ros(m->header.stamp), from_pose(m->pose.pose),
                                      field_ros::get_covariance(m->pose.covariance));
    return line.back() == '\n' ? line : line + "\n";
  }
  throw field_core::DataError("topic '" + instance.getTopic() + "': its " + instance.getDataType() +
                              " has another md5sum than this program's; try rosbag fix");
}

int print(const std::string& path, const std::string& topic) {
  const std::string with_covariance = "geometry_msgs/PoseWithCovarianceStamped";
  const field_ros::BagInput input(path);
  input.require(topic, {"nav_msgs/Odometry", "geometry_msgs/PoseStamped", with_covariance,
                        "geometry_msgs/TransformStamped"});
  std::string text = kPlainHeader;
  if (input.topics().at(topic) == with_covariance) {
    text = std::string(field_core::kEstimateCsvHeader) + "\n";
  }
  // All or nothing: a damaged bag must not leave half a table in a pipe.
  input.read({topic}, [&text](const rosbag::MessageInstance& instance, double) {
    text += lines_of(instance);
  });
  std::cout << text << std::flush;
  return field_ros::kExitOk;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Prints stamp_s,x_m,y_m,yaw_rad of a topic of poses: nav_msgs/Odometry or "
      "geometry_msgs/PoseStamped, PoseWithCovarianceStamped (with covariance columns), "
      "TransformStamped.");
  std::string bag, topic;
  app.add_option("bag", bag, "bag to read")->required();
  app.add_option("topic", topic, "topic of poses")->required();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? field_ros::kExitOk : field_ros::kExitBadArguments;
  }
  return field_ros::run_guarded([&] { return print(bag, topic); });
}
