#include "field_ros/bag_input.hpp"

#include <console_bridge/console.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "field_core/errors.hpp"

namespace field_ros {
namespace {

using field_core::DataError;

/// ROS's libraries print lines of their own about damaged headers; the exception says all there is.
class QuietLibraries {
 public:
  QuietLibraries() { console_bridge::noOutputHandler(); }
  ~QuietLibraries() { console_bridge::restorePreviousOutputHandler(); }
  QuietLibraries(const QuietLibraries&) = delete;
  QuietLibraries& operator=(const QuietLibraries&) = delete;
};

[[noreturn]] void fail_damaged(const std::string& path, const std::exception& e) {
  throw DataError(path + ": the bag is truncated or damaged (" + e.what() +
                  "); try 'rosbag reindex " + path + "' or record it again");
}

}  // namespace

BagInput::BagInput(const std::string& path) : path_(path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    throw DataError(path + ": cannot be read: " + std::strerror(errno) +
                    "; check the path of the bag");
  }
  char start[8] = {};
  if (!file.read(start, 7) || std::string(start, 7) != "#ROSBAG") {
    throw DataError(path +
                    ": is not a bag; record one with 'rosbag record' or make one with csv_to_bag");
  }
  const QuietLibraries quiet;
  try {
    bag_.open(path, rosbag::bagmode::Read);
    rosbag::View view(bag_);
    for (const rosbag::ConnectionInfo* info : view.getConnections()) {
      topics_[info->topic] = info->datatype;
    }
    if (view.size() == 0) throw DataError(path + ": the bag holds no message; record it again");
  } catch (const rosbag::BagUnindexedException&) {
    throw DataError(path +
                    ": the bag has no index, its recording was cut off; run 'rosbag reindex " +
                    path + "'");
  } catch (const rosbag::BagException& e) {
    fail_damaged(path, e);
  }
}

void BagInput::require(const std::string& topic, const std::vector<std::string>& types) const {
  const auto wanted = [&types](const std::string& type) {
    return std::find(types.begin(), types.end(), type) != types.end();
  };
  const auto it = topics_.find(topic);
  if (it != topics_.end() && wanted(it->second)) return;
  std::string candidates;
  for (const auto& [name, type] : topics_) {
    if (wanted(type)) candidates += (candidates.empty() ? "" : ", ") + name;
  }
  const std::string problem = it == topics_.end() ? "there is no topic '" + topic + "'"
                                                  : "topic '" + topic + "' is " + it->second;
  std::string expected;
  for (const auto& type : types) expected += (expected.empty() ? "" : " or ") + type;
  throw DataError(path_ + ": " + problem + "; topics of type " + expected +
                  " in this bag: " + (candidates.empty() ? "none" : candidates));
}

void BagInput::read(
    const std::vector<std::string>& topics,
    const std::function<void(const rosbag::MessageInstance&, double)>& on_message) const {
  const QuietLibraries quiet;
  try {
    rosbag::View view(bag_, rosbag::TopicQuery(topics));
    const double total = std::max<double>(1.0, view.size());
    std::size_t count = 0;
    for (const rosbag::MessageInstance& message : view) {
      on_message(message, static_cast<double>(++count) / total);
    }
  } catch (const rosbag::BagException& e) {
    fail_damaged(path_, e);
  } catch (const ros::serialization::StreamOverrunException& e) {
    fail_damaged(path_, e);
  }
}

}  // namespace field_ros
