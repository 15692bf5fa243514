// Prints a topic of poses in a bag as CSV.
#include "field_ros/bag_trajectory.hpp"

#include <CLI/CLI.hpp>
#include <iostream>
#include <string>

#include "field_core/csv.hpp"
#include "field_core/trajectory.hpp"
#include "field_ros/bag_input.hpp"
#include "field_ros/program.hpp"

namespace {

using field_core::format_number;

const char* const kPlainHeader = "stamp_s,x_m,y_m,yaw_rad\n";

std::string line_of(const field_core::StampedPose& p) {
  if (p.covariance) {
    const std::string line = field_core::estimate_csv_line(p.stamp, p.pose, *p.covariance);
    return line.back() == '\n' ? line : line + "\n";
  }
  return field_core::format_stamp(p.stamp) + "," + format_number(p.pose.x()) + "," +
         format_number(p.pose.y()) + "," + format_number(p.pose.yaw()) + "\n";
}

int print(const std::string& path, const std::string& topic) {
  const field_ros::BagInput input(path);
  // All or nothing: a damaged bag must not leave half a table in a pipe.
  const field_core::Trajectory trajectory = field_ros::read_bag_trajectory(input, topic);
  const bool covariances = input.topics().at(topic) == "geometry_msgs/PoseWithCovarianceStamped";
  std::string text =
      covariances ? std::string(field_core::kEstimateCsvHeader) + "\n" : kPlainHeader;
  for (const field_core::StampedPose& pose : trajectory) text += line_of(pose);
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
