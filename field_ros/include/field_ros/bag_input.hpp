// Opening bags with messages that say what is wrong and what to do.
#pragma once

#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

namespace field_ros {

class BagInput {
 public:
  /// @throws DataError: missing, unreadable, no bag, truncated or unindexed, empty
  explicit BagInput(const std::string& path);

  const std::string& path() const { return path_; }
  const rosbag::Bag& bag() const { return bag_; }
  /// Type of each topic.
  const std::map<std::string, std::string>& topics() const { return topics_; }

  /// @throws DataError unless the topic holds messages of one of the types; lists the topics that
  /// do
  void require(const std::string& topic, const std::vector<std::string>& types) const;

  /// Calls back for every message of the topics in order of receipt; `fraction` of the bag read so
  /// far.
  /// @throws DataError if the bag is damaged
  void read(
      const std::vector<std::string>& topics,
      const std::function<void(const rosbag::MessageInstance&, double fraction)>& on_message) const;

 private:
  std::string path_;
  rosbag::Bag bag_;
  std::map<std::string, std::string> topics_;
};

}  // namespace field_ros
