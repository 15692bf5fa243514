#include "field_bags/bag_writer.hpp"

#include <fcntl.h>
#include <rosbag/bag.h>
#include <tf2_msgs/TFMessage.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "field_core/errors.hpp"
#include "messages.hpp"

namespace field_bags {
namespace {

/// One line of the bag's schedule; `kind` also orders messages of one stamp.
struct Event {
  enum Kind { odometry, measurement, position, truth };
  field_core::Stamp stamp;
  Kind kind;
  std::size_t robot, index;
};

std::vector<Event> schedule(const std::vector<Recording>& robots) {
  std::vector<Event> events;
  const auto add = [&events](Event::Kind kind, std::size_t robot, const auto& items) {
    for (std::size_t i = 0; i < items.size(); ++i) {
      events.push_back({items[i].stamp, kind, robot, i});
    }
  };
  for (std::size_t r = 0; r < robots.size(); ++r) {
    add(Event::odometry, r, robots[r].odometry);
    add(Event::measurement, r, robots[r].measurements);
    add(Event::position, r, robots[r].positions);
    add(Event::truth, r, robots[r].truth);
  }
  std::stable_sort(events.begin(), events.end(), [](const Event& a, const Event& b) {
    return a.stamp != b.stamp ? a.stamp < b.stamp : a.kind < b.kind;
  });
  return events;
}

std::string prefix_of(const Recording& recording) {
  return recording.robot.empty() ? "" : recording.robot + "/";
}

// All in one message: of a latched topic the last is kept.
void write_static_transforms(rosbag::Bag& bag, const std::vector<Recording>& robots,
                             ros::Time time) {
  tf2_msgs::TFMessage message;
  const field_core::Stamp stamp(static_cast<std::int64_t>(time.toNSec()));
  for (const Recording& r : robots) {
    if (r.sensor_frame == "base_link") continue;
    message.transforms.push_back(transform_message(
        stamp, prefix_of(r) + "base_link", prefix_of(r) + r.sensor_frame, r.sensor_in_base));
  }
  if (message.transforms.empty()) return;
  const auto header = boost::make_shared<ros::M_string>();
  (*header)["topic"] = "/tf_static";
  (*header)["type"] = ros::message_traits::DataType<tf2_msgs::TFMessage>::value();
  (*header)["md5sum"] = ros::message_traits::MD5Sum<tf2_msgs::TFMessage>::value();
  (*header)["message_definition"] = ros::message_traits::Definition<tf2_msgs::TFMessage>::value();
  (*header)["latching"] = "1";
  bag.write("/tf_static", time, message, header);
}

void write_odometry(rosbag::Bag& bag, const Recording& recording, std::size_t index,
                    ros::Time time) {
  const std::string prefix = prefix_of(recording);
  const auto& pose = recording.odometry[index];
  const auto* previous = index == 0 ? nullptr : &recording.odometry[index - 1];
  bag.write("/" + prefix + "odom", time, odometry_message(prefix, pose, previous));
  tf2_msgs::TFMessage transforms;
  transforms.transforms.push_back(
      transform_message(pose.stamp, prefix + "odom", prefix + "base_link", pose.pose));
  bag.write("/tf", time, transforms);
}

void write_event(rosbag::Bag& bag, const Recording& recording, const Event& event) {
  const std::string prefix = prefix_of(recording), topic = "/" + prefix;
  const ros::Time time = std::max(to_ros(event.stamp), ros::TIME_MIN);
  switch (event.kind) {
    case Event::odometry:
      return write_odometry(bag, recording, event.index, time);
    case Event::measurement:
      return bag.write(topic + "field", time,
                       field_message(prefix + recording.sensor_frame, recording.fields,
                                     recording.measurements[event.index]));
    case Event::position:
      return bag.write(topic + "position", time,
                       position_message(recording.positions[event.index]));
    case Event::truth:
      return bag.write(topic + "ground_truth", time, truth_message(recording.truth[event.index]));
  }
}

void write_all(const std::vector<Recording>& robots, const std::vector<Event>& events,
               const std::string& path) {
  rosbag::Bag bag(path, rosbag::bagmode::Write);
  bag.setCompression(rosbag::compression::BZ2);
  if (!events.empty()) {
    write_static_transforms(bag, robots, std::max(to_ros(events[0].stamp), ros::TIME_MIN));
  }
  for (const Event& event : events) write_event(bag, robots[event.robot], event);
  bag.close();
}

void sync(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY);
  const bool synced = file >= 0 && ::fsync(file) == 0;
  const int reason = errno;
  if (file >= 0) ::close(file);
  if (!synced) throw field_core::DataError(std::strerror(reason));
}

}  // namespace

void write_bag(const std::vector<Recording>& robots, const std::string& path) {
  const std::vector<Event> events = schedule(robots);
  if (!events.empty()) {  // what ROS cannot stamp is refused before there is a file
    to_ros(events.front().stamp);
    to_ros(events.back().stamp);
  }
  const std::string temporary = path + "." + std::to_string(::getpid()) + ".partial";
  try {
    write_all(robots, events, temporary);
    sync(temporary);
    if (std::rename(temporary.c_str(), path.c_str()) != 0) {
      throw field_core::DataError(std::strerror(errno));
    }
  } catch (const std::exception& error) {
    std::remove(temporary.c_str());
    throw field_core::DataError(path + ": cannot be written (" + error.what() +
                                "); check that the folder exists, is writable and has space");
  }
}

}  // namespace field_bags
