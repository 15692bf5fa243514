#include "field_ros/replay.hpp"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>

#include "field_core/errors.hpp"
#include "field_ros/bag_input.hpp"
#include "field_ros/bag_transforms.hpp"
#include "field_ros/obstacles.hpp"
#include "field_ros/program.hpp"
#include "field_ros/replay_output.hpp"
#include "field_ros/robot_interface.hpp"
#include "field_ros/sensors.hpp"
#include "field_ros/session.hpp"
#include "field_ros/state_file.hpp"

namespace field_ros {
namespace {

using field_core::DataError;

std::string absolute_topic(const std::string& topic) {
  return !topic.empty() && topic[0] == '/' ? topic : "/" + topic;
}

class ProgressBar {
 public:
  explicit ProgressBar(bool on) : on_(on) {}
  ~ProgressBar() {
    if (percent_ >= 0) std::cerr << "\r\033[K" << std::flush;
  }
  void show(double fraction) {
    const int percent = static_cast<int>(100.0 * fraction);
    if (!on_ || percent == percent_) return;
    percent_ = percent;
    std::cerr << "\r[" << std::string(percent / 2, '=') << std::string(50 - percent / 2, ' ')
              << "] " << percent << " %" << std::flush;
  }

 private:
  bool on_;
  int percent_ = -1;
};

// The topics of one robot, checked against the bag.
struct RobotTopics {
  RobotTopics(const BagInput& input, RobotInterface topics, bool uses_positions)
      : robot(std::move(topics)) {
    robot.odom = absolute_topic(robot.odom);
    robot.field = absolute_topic(robot.field);
    robot.position = absolute_topic(robot.position);
    input.require(robot.odom, {"nav_msgs/Odometry"});
    all.push_back(robot.odom);
    for (SensorParams& sensor : robot.sensors) {
      sensor.topic = absolute_topic(sensor.topic);
      input.require(sensor.topic, {sensor_datatype(sensor.type)});
      all.push_back(sensor.topic);
    }
    // What else there is of measurements may be absent if there are some.
    bool others = !robot.sensors.empty();
    if (uses_positions && input.topics().count(robot.position)) {
      input.require(robot.position, {"geometry_msgs/PoseWithCovarianceStamped"});
      all.push_back(robot.position);
      others = true;
    }
    if (!others || input.topics().count(robot.field)) {
      input.require(robot.field, {"field_msgs/FieldMeasurement"});
      all.push_back(robot.field);
    }
  }

  RobotInterface robot;
  std::vector<std::string> all;
};

// Robots whose odometry is in the bag: of several some may be missing, as they may live.
std::vector<std::optional<RobotTopics>> topics_of(const BagInput& input,
                                                  const ReplayOptions& options,
                                                  const Configured& configured) {
  auto robots = robot_interfaces(configured.node, configured.estimator->robots());
  const bool alone = robots.size() == 1;
  if (!alone && !(options.odom_topic.empty() && options.field_topic.empty())) {
    throw DataError(options.config +
                    ": has several robots, for which --odom-topic and --field-topic mean nothing; "
                    "set robot_interfaces");
  }
  if (!options.odom_topic.empty()) robots[0].odom = options.odom_topic;
  if (!options.field_topic.empty()) robots[0].field = options.field_topic;
  std::vector<std::optional<RobotTopics>> topics;
  bool any = alone;
  for (const RobotInterface& robot : robots) {
    any = any || input.topics().count(absolute_topic(robot.odom)) > 0;
  }
  for (RobotInterface& robot : robots) {
    const std::string odom = absolute_topic(robot.odom);
    if (any && !alone && input.topics().count(odom) == 0) {
      std::cerr << input.path() << ": nothing of robot '" << robot.name << "' (" << odom << ")\n";
      topics.emplace_back();
      continue;
    }
    topics.emplace_back(
        RobotTopics(input, std::move(robot), configured.estimator->uses_positions()));
  }
  return topics;
}

template <class M>
const M& typed(const BagInput& input, const rosbag::MessageInstance& instance,
               boost::shared_ptr<M>& holder) {
  holder = instance.instantiate<M>();
  if (holder) return *holder;
  throw DataError(input.path() + ": topic '" + instance.getTopic() + "': its " +
                  instance.getDataType() +
                  " has another md5sum than this program's; record it with this version of the "
                  "messages, or use rosbag fix");
}

// The first of the bag, as a node that is there before the run gets it.
void take_obstacles(const BagInput& input, Configured& configured) {
  if (!configured.node.use_map_topic) return;
  const std::string topic = absolute_topic("map");
  input.require(topic, {"nav_msgs/OccupancyGrid"});
  rosbag::View view(input.bag(), rosbag::TopicQuery(topic));
  boost::shared_ptr<nav_msgs::OccupancyGrid> map;
  try {
    configured.estimator->set_obstacles(
        to_mask(typed(input, *view.begin(), map), configured.node.global_frame_id));
  } catch (const DataError& e) {
    throw DataError(input.path() + ": the map on " + topic + " cannot be used: " + e.what());
  }
}

void dispatch(const BagInput& input, const RobotTopics& topics, int index,
              const rosbag::MessageInstance& instance, Session& session) {
  const std::string& topic = instance.getTopic();
  const RobotInterface& robot = topics.robot;
  if (topic == robot.odom) {
    boost::shared_ptr<nav_msgs::Odometry> odometry;
    session.on_odometry(typed(input, instance, odometry), index);
  } else if (topic == robot.field) {
    boost::shared_ptr<field_msgs::FieldMeasurement> field;
    session.on_field(typed(input, instance, field), index);
  } else if (topic == robot.position && session.estimator().uses_positions()) {
    boost::shared_ptr<geometry_msgs::PoseWithCovarianceStamped> position;
    session.on_position(typed(input, instance, position), index);
  }
  for (const SensorParams& sensor : robot.sensors) {
    if (topic != sensor.topic) continue;
    with_sensor_message(sensor.type, [&](auto* type) {
      boost::shared_ptr<std::remove_pointer_t<decltype(type)>> message;
      session.on_field(to_field(typed(input, instance, message), sensor), index);
    });
  }
}

[[noreturn]] void fail_nothing_used(const std::string& bag, const SessionCounts& counts,
                                    std::size_t waiting) {
  std::string reasons;
  for (const auto& [name, count] : counts.dropped) {
    reasons += (reasons.empty() ? "" : ", ") + std::to_string(count) + " " + name;
  }
  if (waiting > 0) {
    reasons += (reasons.empty() ? "" : ", ") + std::to_string(waiting) +
               " without odometry at their stamp";
  }
  throw DataError(
      bag + ": no measurement could be used (dropped: " + (reasons.empty() ? "none" : reasons) +
      "); compare stamps, frames and field names of the bag with the configuration");
}

void refuse_nothing_used(const ReplayOptions& options, const Session& session,
                         std::size_t waiting) {
  const SessionCounts counts = session.total();
  if (counts.applied > 0 || !counts.skipped.empty()) return;
  for (int robot = 0; robot < session.robots(); ++robot) {
    const std::string& error = session.last_error(robot);
    if (!error.empty()) throw field_core::NumericalError(error);
  }
  fail_nothing_used(options.bag, counts, waiting);
}

double bag_duration(const BagInput& input) {
  rosbag::View view(input.bag());
  return (view.getEndTime() - view.getBeginTime()).toSec();
}

void refuse_bad_places(const ReplayOptions& options) {
  namespace fs = std::filesystem;
  if (fs::exists(options.output) && !fs::is_directory(options.output)) {
    throw DataError(options.output + ": is a file; --output needs a directory");
  }
  if (!options.save_state.empty()) {
    const fs::path parent = fs::absolute(options.save_state).parent_path();
    if (!fs::is_directory(parent)) {
      throw DataError(options.save_state + ": its directory does not exist; create " +
                      parent.string());
    }
  }
}

void load_state(Session& session, const std::string& path) {
  if (path.empty()) return;
  const auto state = read_state_file(path);
  try {
    session.restore(state);
  } catch (const DataError& e) {
    throw DataError(path + ": " + e.what());
  }
}

void add_maps(ReplayOutput& output, const Session& session, const ReplayOptions& options) {
  output.add_fields(session);
  if (options.export_maps) output.add_map_files(session);
  if (!options.predict.empty()) output.add_prediction(session, options.predict);
}

// The maps of a state alone.
void write_maps(Configured configured, const ReplayOptions& options) {
  if (configured.node.use_map_topic) {
    throw DataError(options.config +
                    ": use_map_topic needs a --bag that holds the map; without one the maps of "
                    "a state with walls cannot be drawn");
  }
  Session session(std::move(configured), [](const std::string&, const std::string&,
                                            field_core::Stamp) { return std::nullopt; });
  load_state(session, options.load_state);
  ReplayOutput output;
  add_maps(output, session, options);
  output.write(options.output);
}

// Runs the bag through the session; returns how many measurements are left without odometry.
std::size_t run(const BagInput& input, const std::vector<std::optional<RobotTopics>>& robots,
                Session& session, bool progress) {
  ProgressBar bar(progress);
  std::vector<std::string> topics;
  for (const auto& robot : robots) {
    if (robot) topics.insert(topics.end(), robot->all.begin(), robot->all.end());
  }
  input.read(topics, [&](const rosbag::MessageInstance& instance, double fraction) {
    for (std::size_t r = 0; r < robots.size(); ++r) {
      if (robots[r]) dispatch(input, *robots[r], static_cast<int>(r), instance, session);
    }
    bar.show(fraction);
  });
  return session.finish();
}

}  // namespace

void replay(const EstimatorEntry& entry, const ReplayOptions& options) {
  const ParamTree tree = ParamTree::from_yaml_file(options.config);
  Configured configured = entry.make(tree, options.seed);
  refuse_bad_places(options);
  if (options.bag.empty()) return write_maps(std::move(configured), options);
  const std::uint64_t seed =
      options.seed.value_or(static_cast<std::uint64_t>(configured.node.seed));
  const BagInput input(options.bag);
  const auto topics = topics_of(input, options, configured);
  take_obstacles(input, configured);
  BagTransforms transforms(input);
  Session session(std::move(configured), std::ref(transforms));
  load_state(session, options.load_state);
  ReplayOutput output;
  session.set_listener([&output](const SessionStep& step) { output.add(step); });
  const std::size_t waiting = run(input, topics, session, options.progress);
  refuse_nothing_used(options, session, waiting);
  output.add_trajectories(session);
  add_maps(output, session, options);
  output.add_summary(session, entry.name, seed, bag_duration(input), waiting);
  output.write(options.output);
  if (!options.save_state.empty()) write_state_file(options.save_state, session.save_state());
}

int run_replay(int argc, char** argv, const EstimatorEntry& entry) {
  ReplayOptions options;
  bool print_config = false, print_markdown = false;
  std::uint64_t seed = 0;
  CLI::App app(
      "Runs " + entry.name +
      " over a bag, without roscore, and writes estimate, field maps, timing and a summary; "
      "with --load-state and no --bag only the maps of that state.");
  auto* config_only = app.add_flag("--print-config", print_config,
                                   "print a commented configuration with all defaults, and exit");
  auto* markdown_only =
      app.add_flag("--print-markdown", print_markdown, "print the parameters as a table, and exit");
  app.add_option("--bag", options.bag, "bag to read");
  app.add_option("--config", options.config, "YAML of parameters, the same as the node's");
  app.add_option("--output", options.output, "directory for the results");
  auto* seed_option = app.add_option("--seed", seed, "replaces the parameter seed");
  app.add_option("--odom-topic", options.odom_topic,
                 "nav_msgs/Odometry, instead of /odom or what the configuration says");
  app.add_option("--field-topic", options.field_topic,
                 "field_msgs/FieldMeasurement, instead of /field or what the configuration says");
  app.add_option("--predict", options.predict, "CSV with columns x_m,y_m: writes prediction.csv");
  app.add_option("--load-state", options.load_state, "state file to start from");
  app.add_option("--save-state", options.save_state, "state file to write at the end");
  app.add_flag(
      "--export-maps", options.export_maps,
      "also write each field for map_server (PGM, YAML) and as a grid that QGIS reads (ASC)");
  try {
    app.parse(argc, argv);
    if (!*config_only && !*markdown_only) {
      for (const char* name : {"--bag", "--config", "--output"}) {
        const bool maps_only = name == std::string("--bag") && !options.load_state.empty();
        if (app.get_option(name)->count() == 0 && !maps_only) throw CLI::RequiredError(name);
      }
      if (options.bag.empty() && !options.save_state.empty()) {
        throw CLI::ValidationError("--save-state", "needs a --bag to learn from");
      }
    }
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kExitOk : kExitBadArguments;
  }
  if (*seed_option) options.seed = seed;
  options.progress = ::isatty(STDERR_FILENO) == 1;
  return run_guarded([&] {
    if (print_config) {
      std::cout << commented_yaml(entry.document());
    } else if (print_markdown) {
      std::cout << markdown_table(entry.document());
    } else {
      replay(entry, options);
    }
    return kExitOk;
  });
}

}  // namespace field_ros
