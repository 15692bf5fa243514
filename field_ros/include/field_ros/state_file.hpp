// State files: bags that hold one field_msgs/EstimatorState on /state.
#pragma once

#include <field_msgs/EstimatorState.h>

#include <string>

namespace field_ros {

/// Writes the file whole or not at all: to a temporary file beside it that is synced, then renamed.
/// A process killed at any moment, or a power failure, leaves the old file or the new one; what it
/// may have left beside it is removed by the next writing. One writer per process and file.
/// @throws DataError with the path and the system's reason
void write_state_file(const std::string& path, const field_msgs::EstimatorState& state);

/// @throws DataError: no bag, no /state, or a message of another type or version (md5sum)
field_msgs::EstimatorState read_state_file(const std::string& path);

/// DIRECTORY/NAME.bag with "~/" expanded.
/// @throws DataError unless the name is made of letters, digits, '_' and '-', or if the directory
/// is ""
std::string state_path(const std::string& directory, const std::string& name);

/// Creates the directory and its parents if missing. @throws DataError with the system's reason
void create_directories(const std::string& path);

}  // namespace field_ros
