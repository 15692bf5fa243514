#include "field_ros/param_values.hpp"

#include <algorithm>

namespace field_ros {
namespace {

constexpr std::size_t kMostNamed = 5;

}  // namespace

bool may_differ_from_state(const std::string& path, const std::vector<std::string>& free) {
  const auto begins = [&path](const std::string& start) { return path.rfind(start, 0) == 0; };
  if (begins("initial_") || begins("odom_alpha") || begins("update_min_")) return true;
  return std::any_of(free.begin(), free.end(),
                     [&](const std::string& key) { return path == key || begins(key + "/"); });
}

std::string describe_differences(const ParamValues& state, const ParamValues& here,
                                 const std::vector<std::string>& free) {
  std::vector<std::string> differences;
  const auto value = [](const ParamValues& values, const std::string& path) {
    const auto found = values.find(path);
    return found == values.end() ? std::string("nothing") : found->second;
  };
  ParamValues all = state;
  all.insert(here.begin(), here.end());
  for (const auto& [path, ignored] : all) {
    const std::string theirs = value(state, path), ours = value(here, path);
    if (theirs == ours || may_differ_from_state(path, free)) continue;
    differences.push_back(path + ": " + theirs + " in the state, " + ours + " here");
  }
  std::string text;
  for (std::size_t i = 0; i < std::min(kMostNamed, differences.size()); ++i) {
    text += (i > 0 ? "; " : "") + differences[i];
  }
  if (differences.size() > kMostNamed) {
    text += "; and " + std::to_string(differences.size() - kMostNamed) + " more";
  }
  return text;
}

}  // namespace field_ros
