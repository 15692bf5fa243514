// The files that a replay writes, kept in memory until the run has succeeded.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "field_ros/session.hpp"

namespace field_ros {

class ReplayOutput {
 public:
  void add(const SessionStep& step);

  /// estimate.tum, estimate.csv and timing.csv of the steps so far; of several robots, each its own
  /// with its name: estimate_<robot>.tum and so on. Stamps of poses increase; timing has every
  /// step.
  void add_trajectories(const Session& session);
  /// field_<name>.csv of the final belief, on the estimator's map region.
  void add_fields(const Session& session);
  /// Each field and its standard deviation for map_server and for geographic programs
  /// (map_files.hpp).
  void add_map_files(const Session& session);
  /// prediction.csv at the points of a CSV (columns x_m,y_m). @throws DataError
  void add_prediction(const Session& session, const std::string& points_csv);
  /// summary.json: nothing in it depends on the machine. Of several robots it has the sums, and
  /// each robot's own numbers in "robots".
  void add_summary(const Session& session, const std::string& estimator, std::uint64_t seed,
                   double duration_s, std::size_t left_waiting);

  /// Writes all files to a temporary directory inside `directory`, then renames them into it.
  /// @throws DataError; the files of an earlier run are untouched if writing failed
  void write(const std::string& directory);

  /// Contents by file name, for tests.
  const std::map<std::string, std::string>& files() const { return files_; }

 private:
  struct Lines {
    std::string estimate_tum, estimate_csv, timing_csv;
    std::optional<field_core::Stamp> stamp;  // of the last pose, and where its lines begin
    std::size_t last_tum = 0, last_csv = 0;
  };

  std::map<int, Lines> robots_;
  std::map<std::string, std::string> files_;
};

}  // namespace field_ros
