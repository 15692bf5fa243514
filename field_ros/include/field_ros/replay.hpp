// The program <package>_replay: an estimator over a bag, without roscore.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "field_ros/any_estimator.hpp"

namespace field_ros {

struct ReplayOptions {
  std::string bag;  ///< empty: nothing is run, only the maps of load_state are written
  std::string config;
  std::string output;  ///< directory; files of an earlier run are replaced
  std::optional<std::uint64_t> seed;
  /// Of the one robot; empty: /odom and /field, or what robot_interfaces says.
  std::string odom_topic, field_topic;
  std::string predict;       ///< CSV with columns x_m,y_m; empty: no prediction.csv
  std::string load_state;    ///< state file to start from; empty: none
  std::string save_state;    ///< state file to write at the end; empty: none
  bool export_maps = false;  ///< also write the maps for map_server and geographic programs
  bool progress = false;     ///< bar on standard error
};

/// Reads the bag through a Session and writes the files of DESIGN section 4; all but timing.csv
/// depend on the bag, the configuration and the seed only.
/// @throws DataError, NumericalError; nothing is written then
void replay(const EstimatorEntry& entry, const ReplayOptions& options);

/// Command line of the program. Exit code 0; 1: bad data, one line on standard error; 2: bad
/// arguments.
int run_replay(int argc, char** argv, const EstimatorEntry& entry);

template <class E>
int run_replay(int argc, char** argv) {
  return run_replay(argc, argv, estimator_entry<E>());
}

}  // namespace field_ros
