#include "field_ros/obstacles.hpp"

#include <ros/callback_queue.h>
#include <ros/ros.h>

#include <cmath>

#include "field_core/errors.hpp"
#include "field_ros/convert.hpp"
#include "field_ros/message_check.hpp"

namespace field_ros {
namespace {

constexpr double kAwaitMapLogPeriod = 10.0;  // [s] of wall time
constexpr double kLargestTilt = 1e-3;        // of the quaternion's x and y

void check_origin(const geometry_msgs::Pose& origin) {
  const auto& q = origin.orientation;
  if (check_pose(origin) == DropReason::none && std::abs(q.x) <= kLargestTilt &&
      std::abs(q.y) <= kLargestTilt) {
    return;
  }
  throw field_core::DataError(
      "its origin is not a pose in the plane; set position and a quaternion about z of length 1");
}

}  // namespace

field_core::OccupancyMask to_mask(const nav_msgs::OccupancyGrid& map,
                                  const std::string& global_frame) {
  using field_core::DataError;
  const std::string frame = tf2_frame(map.header.frame_id);
  if (!frame.empty() && frame != global_frame) {
    throw DataError("it is in the frame '" + frame + "', fields are in '" + global_frame +
                    "'; set global_frame_id or the frame_id of map_server");
  }
  const std::size_t cells = static_cast<std::size_t>(map.info.width) * map.info.height;
  if (cells == 0 || map.data.size() != cells) {
    throw DataError("it has " + std::to_string(map.data.size()) + " cells, its size is " +
                    std::to_string(map.info.width) + " x " + std::to_string(map.info.height) +
                    "; publish a map whose data is complete");
  }
  if (!(map.info.resolution > 0.0F) || !std::isfinite(map.info.resolution)) {
    throw DataError("its resolution is not positive; set it in the map's YAML");
  }
  check_origin(map.info.origin);
  field_core::OccupancyMask mask;
  const field_core::SE2 origin = from_pose(map.info.origin);
  mask.corner = origin.translation();
  mask.yaw = origin.yaw();
  mask.resolution = map.info.resolution;
  mask.width = static_cast<int>(map.info.width);
  mask.height = static_cast<int>(map.info.height);
  mask.occupied.reserve(cells);
  for (const auto value : map.data) mask.occupied.push_back(value >= kOccupiedValue);
  return mask;
}

void await_obstacles(Configured& configured) {
  if (!configured.node.use_map_topic) return;
  bool done = false;
  ros::NodeHandle handle;
  const ros::Subscriber subscriber = handle.subscribe<nav_msgs::OccupancyGrid>(
      "map", 1, [&](const nav_msgs::OccupancyGrid::ConstPtr& map) {
        if (done) return;
        try {
          configured.estimator->set_obstacles(to_mask(*map, configured.node.global_frame_id));
          done = true;
        } catch (const field_core::DataError& e) {
          ROS_ERROR("map on %s is not used: %s", handle.resolveName("map").c_str(), e.what());
        }
      });
  ros::WallTime next_log = ros::WallTime::now() + ros::WallDuration(1.0);
  while (ros::ok() && !done) {
    ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.1));
    if (done || ros::WallTime::now() < next_log) continue;
    ROS_WARN(
        "waiting for a map on %s (use_map_topic); start map_server, or set use_map_topic: false",
        handle.resolveName("map").c_str());
    next_log = ros::WallTime::now() + ros::WallDuration(kAwaitMapLogPeriod);
  }
}

}  // namespace field_ros
