#include "trajectory_source.hpp"

#include "field_core/csv.hpp"
#include "field_core/errors.hpp"
#include "subprocess.hpp"

namespace field_eval {
namespace {

using field_core::DataError;

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() > end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

// Position of the colon of "x.bag:/topic"; npos for anything else.
std::size_t topic_colon(const std::string& source) {
  const auto colon = source.rfind(".bag:");
  return colon == std::string::npos || colon == 0 || colon + 5 == source.size() ? std::string::npos
                                                                                : colon + 4;
}

field_core::Trajectory load_from_bag(const std::string& bag, const std::string& topic) {
  const auto result = run({"rosrun", "field_ros", "bag_trajectory", bag, topic});
  if (result.exit_code == 127) {
    throw DataError("cannot read '" + bag +
                    "': no rosrun on PATH; source the workspace's setup.bash first");
  }
  if (result.exit_code != 0) {
    std::string reason = last_line(result.errors);
    if (reason.rfind("error: ", 0) == 0) reason.erase(0, 7);
    if (reason.find(bag) != std::string::npos) throw DataError(reason);  // it says where by itself
    if (reason.empty()) reason = "exit code " + std::to_string(result.exit_code);
    throw DataError("cannot read " + topic + " of '" + bag + "': " + reason);
  }
  return field_core::trajectory_from_csv(
      field_core::CsvTable::parse(result.output, bag + ":" + topic));
}

}  // namespace

std::string problem_of_source(const std::string& source) {
  if (ends_with(source, ".tum") || ends_with(source, ".csv")) return {};
  if (topic_colon(source) != std::string::npos) return {};
  if (ends_with(source, ".bag") || ends_with(source, ".bag:")) {
    return "'" + source + "' names no topic; write " + source.substr(0, source.rfind(".bag")) +
           ".bag:/topic";
  }
  return "'" + source + "' is none of x.tum, x.csv, x.bag:/topic";
}

field_core::Trajectory load(const std::string& source) {
  const auto colon = topic_colon(source);
  if (colon == std::string::npos) return field_core::read_trajectory(source);
  return load_from_bag(source.substr(0, colon), source.substr(colon + 1));
}

}  // namespace field_eval
