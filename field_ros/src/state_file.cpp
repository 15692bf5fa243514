#include "field_ros/state_file.hpp"

#include <fcntl.h>
#include <rosbag/bag.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "field_core/errors.hpp"
#include "field_ros/bag_input.hpp"

namespace field_ros {

using field_core::DataError;

namespace {

constexpr const char* kTopic = "/state";

DataError system_error(const std::string& path, const std::string& doing) {
  return DataError(path + ": cannot be " + doing + ": " + std::strerror(errno) +
                   "; check the directory and its permissions");
}

const char* const kPartial = ".partial-";

bool sync(const std::string& path, int flags) {
  const int file = ::open(path.c_str(), flags | O_CLOEXEC);
  const bool synced = file >= 0 && ::fsync(file) == 0;
  if (file >= 0) ::close(file);
  return synced;
}

void sync_and_rename(const std::string& temporary, const std::string& path) {
  if (!sync(temporary, O_RDONLY) || ::rename(temporary.c_str(), path.c_str()) != 0) {
    throw system_error(path, "written");
  }
  // The folder's entry must reach the disk as well; some file systems cannot sync folders.
  const auto folder = std::filesystem::path(path).parent_path();
  (void)sync(folder.empty() ? "." : folder.string(), O_RDONLY | O_DIRECTORY);
}

// What processes that were killed while they wrote this file have left behind.
void remove_abandoned(const std::string& path) {
  namespace fs = std::filesystem;
  const fs::path target(path);
  const std::string start = target.filename().string() + kPartial;
  std::error_code ignored;
  const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    if (name.rfind(start, 0) != 0) continue;
    const int process = std::atoi(name.c_str() + start.size());
    const bool gone = process > 0 && ::kill(process, 0) != 0 && errno == ESRCH;
    if (gone) fs::remove(entry.path(), ignored);
  }
}

}  // namespace

void write_state_file(const std::string& path, const field_msgs::EstimatorState& state) {
  remove_abandoned(path);
  const std::string temporary = path + kPartial + std::to_string(::getpid());
  try {
    rosbag::Bag bag(temporary, rosbag::bagmode::Write);
    bag.write(kTopic, std::max(state.header.stamp, ros::TIME_MIN), state);
    bag.close();
    sync_and_rename(temporary, path);
  } catch (const rosbag::BagException&) {
    const DataError error = system_error(path, "written");
    ::unlink(temporary.c_str());
    throw error;
  } catch (...) {
    ::unlink(temporary.c_str());
    throw;
  }
}

field_msgs::EstimatorState read_state_file(const std::string& path) {
  const BagInput input(path);
  const std::string remedy = "; use a file written by ~save_state or --save-state";
  if (!input.topics().count(kTopic)) throw DataError(path + ": holds no " + kTopic + remedy);
  field_msgs::EstimatorState state;
  int states = 0;
  input.read({kTopic}, [&](const rosbag::MessageInstance& message, double) {
    const auto typed = message.instantiate<field_msgs::EstimatorState>();
    if (!typed) {
      throw DataError(path + ": " + kTopic + " is " + message.getDataType() + " with md5sum " +
                      message.getMD5Sum() + ", this program reads field_msgs/EstimatorState with " +
                      ros::message_traits::md5sum<field_msgs::EstimatorState>() +
                      "; it was written by another version" + remedy);
    }
    state = *typed;
    ++states;
  });
  if (states != 1) {
    throw DataError(path + ": holds " + std::to_string(states) + " states instead of one" + remedy);
  }
  return state;
}

std::string state_path(const std::string& directory, const std::string& name) {
  const auto allowed = [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-'; };
  if (directory.empty()) {
    throw DataError("no states are kept here; set the parameter state_directory");
  }
  if (name.empty() || name.size() > 200 || !std::all_of(name.begin(), name.end(), allowed)) {
    throw DataError("'" + name.substr(0, 200) +
                    "' is not a name of a state; use letters, digits, '_' and '-' only");
  }
  std::string expanded = directory;
  if (expanded.compare(0, 2, "~/") == 0) {
    const char* home = std::getenv("HOME");
    if (!home) throw DataError("HOME is not set; give state_directory as an absolute path");
    expanded = home + expanded.substr(1);
  }
  return expanded + "/" + name + ".bag";
}

void create_directories(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (!error && std::filesystem::is_directory(path, error)) return;
  throw DataError(path + ": cannot be made a directory: " +
                  (error ? error.message() : std::string("a file is in the way")) +
                  "; choose another place or check the permissions");
}

}  // namespace field_ros
