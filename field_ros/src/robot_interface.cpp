#include "field_ros/robot_interface.hpp"

#include <algorithm>
#include <cctype>
#include <set>

#include "field_core/errors.hpp"

namespace field_ros {
namespace {

using field_core::ParameterError;

std::string in_namespace(const std::string& name_space, const std::string& name) {
  return name_space.empty() || name[0] == '/' ? name : name_space + "/" + name;
}

RobotInterface interface_of(const NodeParams& params, const std::string& robot, bool alone) {
  const auto own = params.robot_interfaces.find(robot);
  const RobotParams p = own == params.robot_interfaces.end() ? RobotParams() : own->second;
  const std::string space = !p.name_space.empty() ? p.name_space : alone ? "" : robot;
  const auto frame = [&space](const std::string& given, const std::string& common) {
    return given.empty() ? in_namespace(space, common) : given;
  };
  RobotInterface out;
  out.name = robot;
  out.prefix = alone ? "" : robot + "/";
  out.odom = in_namespace(space, p.odom);
  out.field = in_namespace(space, p.field);
  out.position = in_namespace(space, p.position);
  out.initialpose = in_namespace(space, p.initialpose);
  out.odom_frame_id = frame(p.odom_frame_id, params.odom_frame_id);
  out.base_frame_id = frame(p.base_frame_id, params.base_frame_id);
  for (const auto& entry : p.sensors.empty() ? params.sensors : p.sensors) {
    out.sensors.push_back(entry.second);
    out.sensors.back().topic = in_namespace(space, entry.second.topic);
  }
  return out;
}

void refuse_unknown(const NodeParams& params, const std::vector<std::string>& robots) {
  for (const auto& [name, own] : params.robot_interfaces) {
    const std::string key = "robot_interfaces/" + name;
    if (std::find(robots.begin(), robots.end(), name) == robots.end()) {
      throw ParameterError(key, "is none of the robots; name it in 'robots' too");
    }
    for (const std::string* topic : {&own.odom, &own.field, &own.position, &own.initialpose}) {
      if (topic->empty()) throw ParameterError(key, "has an empty topic; leave the key out");
    }
  }
}

// A robot's name becomes a topic and a frame.
void refuse_illegal(const std::string& name) {
  const auto letter = [](char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; };
  const auto legal = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; };
  if (!name.empty() && letter(name[0]) && std::all_of(name.begin(), name.end(), legal)) return;
  throw ParameterError("robots", "'" + name +
                                     "' becomes topics and frames; begin with a letter and use "
                                     "letters, digits and '_' only");
}

void refuse_shared(const std::vector<RobotInterface>& robots) {
  std::set<std::string> topics, frames;
  for (const RobotInterface& robot : robots) {
    const std::string key = "robot_interfaces/" + robot.name;
    std::vector<std::string> own = {robot.odom, robot.field, robot.position, robot.initialpose};
    for (const SensorParams& sensor : robot.sensors) own.push_back(sensor.topic);
    for (const std::string& topic : std::set<std::string>(own.begin(), own.end())) {
      if (topics.insert(topic).second) continue;
      throw ParameterError(
          key, "shares the topic '" + topic + "' with another robot; give each its own namespace");
    }
    if (!frames.insert(robot.odom_frame_id).second) {
      throw ParameterError(key, "shares the odom_frame_id '" + robot.odom_frame_id +
                                    "' with another robot; give each its own");
    }
  }
}

}  // namespace

std::vector<RobotInterface> robot_interfaces(const NodeParams& params,
                                             const std::vector<std::string>& robots) {
  refuse_unknown(params, robots);
  const bool alone = robots.size() == 1;
  std::vector<RobotInterface> out;
  for (const std::string& robot : robots) {
    if (!alone) refuse_illegal(robot);
    out.push_back(interface_of(params, robot, alone));
  }
  if (!alone) refuse_shared(out);
  return out;
}

}  // namespace field_ros
