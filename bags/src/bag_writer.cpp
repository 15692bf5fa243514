#include "field_bags/bag_writer.hpp"

#include <fcntl.h>
#include <rosbag/bag.h>
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
  enum Kind { odometry, measurement, truth };
  field_core::Stamp stamp;
  Kind kind;
  std::size_t index;
};

std::vector<Event> schedule(const Recording& recording) {
  std::vector<Event> events;
  const auto add = [&events](Event::Kind kind, const auto& items) {
    for (std::size_t i = 0; i < items.size(); ++i) events.push_back({items[i].stamp, kind, i});
  };
  add(Event::odometry, recording.odometry);
  add(Event::measurement, recording.measurements);
  add(Event::truth, recording.truth);
  std::stable_sort(events.begin(), events.end(), [](const Event& a, const Event& b) {
    return a.stamp != b.stamp ? a.stamp < b.stamp : a.kind < b.kind;
  });
  return events;
}

void write_static_transform(rosbag::Bag& bag, const Recording& recording, ros::Time time) {
  if (recording.sensor_frame == "base_link") return;
  const auto message =
      transform_message(field_core::Stamp(std::int64_t(time.toNSec())), "base_link",
                        recording.sensor_frame, recording.sensor_in_base);
  const auto header = boost::make_shared<ros::M_string>();
  (*header)["topic"] = "/tf_static";
  (*header)["type"] = ros::message_traits::DataType<tf2_msgs::TFMessage>::value();
  (*header)["md5sum"] = ros::message_traits::MD5Sum<tf2_msgs::TFMessage>::value();
  (*header)["message_definition"] = ros::message_traits::Definition<tf2_msgs::TFMessage>::value();
  (*header)["latching"] = "1";
  bag.write("/tf_static", time, message, header);
}

void write_event(rosbag::Bag& bag, const Recording& recording, const Event& event) {
  const ros::Time time = std::max(to_ros(event.stamp), ros::TIME_MIN);
  if (event.kind == Event::odometry) {
    const auto& pose = recording.odometry[event.index];
    const auto* previous = event.index == 0 ? nullptr : &recording.odometry[event.index - 1];
    bag.write("/odom", time, odometry_message(pose, previous));
    bag.write("/tf", time, transform_message(pose.stamp, "odom", "base_link", pose.pose));
  } else if (event.kind == Event::measurement) {
    bag.write("/field", time,
              field_message(recording.sensor_frame, recording.fields,
                            recording.measurements[event.index]));
  } else {
    bag.write("/ground_truth", time, truth_message(recording.truth[event.index]));
  }
}

void write_all(const Recording& recording, const std::vector<Event>& events,
               const std::string& path) {
  rosbag::Bag bag(path, rosbag::bagmode::Write);
  bag.setCompression(rosbag::compression::BZ2);
  if (!events.empty()) {
    write_static_transform(bag, recording, std::max(to_ros(events[0].stamp), ros::TIME_MIN));
  }
  for (const Event& event : events) write_event(bag, recording, event);
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

void write_bag(const Recording& recording, const std::string& path) {
  const std::vector<Event> events = schedule(recording);
  if (!events.empty()) {  // what ROS cannot stamp is refused before there is a file
    to_ros(events.front().stamp);
    to_ros(events.back().stamp);
  }
  const std::string temporary = path + "." + std::to_string(::getpid()) + ".partial";
  try {
    write_all(recording, events, temporary);
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
