#include "field_ros/node.hpp"

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <tf2_ros/transform_listener.h>

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>

#include "field_ros/bag_transforms.hpp"
#include "field_ros/master_watch.hpp"
#include "field_ros/obstacles.hpp"
#include "field_ros/program.hpp"
#include "field_ros/publishers.hpp"
#include "field_ros/reconfigure.hpp"
#include "field_ros/services.hpp"
#include "field_ros/session.hpp"
#include "field_ros/state_keeper.hpp"
#include "live_robot.hpp"

namespace field_ros {
namespace {

// Of wall time: they must come when the clock stands. (diagnostic_updater goes by ROS time.)
constexpr double kDiagnosticsPeriod = 1.0;  // [s]
constexpr double kIdleWait = 0.1;           // [s] between looks at ros::ok()
constexpr double kMasterPeriod = 1.0;       // [s] between looks for a new roscore

// All that the master has to know of.
struct Connections {
  Connections(tf2_ros::Buffer& buffer, Session& session, const StateKeeper& keeper,
              const std::function<void()>& on_clock_reset,
              const std::function<void(const RuntimeParams&)>& change)
      : private_handle("~"),
        listener(buffer),
        maps(private_handle, session),
        services(handle, private_handle, session, [this] { on_replaced(); }),
        reconfigure(private_handle, session.params(), change),
        diagnostics(handle.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 10)) {
    for (int r = 0; r < session.robots(); ++r) {
      robots.push_back(
          std::make_unique<LiveRobot>(handle, private_handle, session, keeper, r, on_clock_reset));
    }
  }

  void on_replaced() {
    for (const auto& robot : robots) robot->on_replaced();
  }

  ros::NodeHandle handle, private_handle;
  tf2_ros::TransformListener listener;
  MapPublishers maps;
  std::vector<std::unique_ptr<LiveRobot>> robots;
  Services services;
  Reconfigure reconfigure;
  ros::Publisher diagnostics;
};

class Node {
 public:
  explicit Node(Configured configured)
      : session_(
            std::move(configured),
            [this](const std::string& base, const std::string& frame, field_core::Stamp stamp) {
              return lookup_placement(buffer_, base, frame, stamp);
            }),
        keeper_(session_),
        master_(kMasterPeriod) {
    session_.set_listener([this](const SessionStep& step) {
      connections_->robots.at(static_cast<std::size_t>(step.robot))->on_step(step);
    });
    session_.defer_steps();
    connect();
    report_timer_ = handle_.createWallTimer(ros::WallDuration(kDiagnosticsPeriod),
                                            [this](const ros::WallTimerEvent&) { report(); });
    schedule_maps();
  }

  /// Takes in all messages that have come before each step: while the machine is too slow, the
  /// oldest measurements are left out (max_pose_lag) instead of the pose falling behind.
  void spin() {
    ros::CallbackQueue& queue = *ros::getGlobalCallbackQueue();
    while (ros::ok()) {
      queue.callAvailable(ros::WallDuration(session_.step_ready() ? 0.0 : kIdleWait));
      session_.step_next();
      keeper_.tick(StateKeeper::Clock::now());
      if (master_.forgotten()) {
        ROS_WARN("roscore was started anew: topics and services are advertised again");
        connect();
      }
    }
    keeper_.finish();
  }

 private:
  void connect() {
    connections_.reset();  // first: what is advertised twice by one node, is advertised once
    connections_ = std::make_unique<Connections>(
        buffer_, session_, keeper_, [this] { on_clock_reset(); },
        [this](const RuntimeParams& params) { change(params); });
    master_.registered();
  }

  void schedule_maps() {
    const double period = session_.params().map_publish_period;
    map_timer_ = ros::WallTimer();
    if (period <= 0.0) return;
    map_timer_ = handle_.createWallTimer(ros::WallDuration(period),
                                         [this](const ros::WallTimerEvent&) { draw(); });
  }

  void change(const RuntimeParams& params) {
    const bool other_period = params.map_publish_period != session_.params().map_publish_period;
    session_.set_runtime_params(params);
    if (other_period) schedule_maps();
  }

  void on_clock_reset() {
    ROS_WARN("time went back: the estimator and its map start again");
    buffer_.clear();
    for (const auto& robot : connections_->robots) robot->clear_path();
  }

  void draw() {
    try {
      connections_->maps.publish();
    } catch (const field_core::NumericalError& e) {
      ROS_WARN_THROTTLE(10.0, "no field map: %s", e.what());
    }
  }

  void report() {
    diagnostic_msgs::DiagnosticArray message;
    for (const auto& robot : connections_->robots) robot->report(message);
    message.header.stamp = ros::Time::now();
    connections_->diagnostics.publish(message);
  }

  ros::NodeHandle handle_;
  tf2_ros::Buffer buffer_;
  Session session_;
  StateKeeper keeper_;
  std::unique_ptr<Connections> connections_;
  MasterWatch master_;
  ros::WallTimer report_timer_, map_timer_;
};

Configured configure(const EstimatorEntry& entry) {
  XmlRpc::XmlRpcValue value;
  const std::string name = ros::this_node::getName();
  ros::param::get(name, value);
  return entry.make(ParamTree::from_rosparam(value, name), std::nullopt);
}

}  // namespace

int run_node(int argc, char** argv, const EstimatorEntry& entry, const char* name) {
  std::vector<std::string> arguments;
  ros::removeROSArgs(argc, argv, arguments);
  CLI::App app("Runs " + entry.name +
               " on the topics odom and field; parameters are in the node's " +
               "private namespace, '" + entry.name + "_replay --print-config' lists them.");
  app.name(std::string(name) + "_node");
  try {
    std::vector<std::string> reversed(arguments.rbegin(), arguments.rend() - 1);
    app.parse(reversed);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kExitOk : kExitBadArguments;
  }
  return run_guarded([&] {
    ros::init(argc, argv, name);
    const ros::NodeHandle keep_alive;
    Configured configured = configure(entry);
    await_obstacles(configured);
    if (!ros::ok()) return kExitOk;
    Node node(std::move(configured));
    node.spin();
    return kExitOk;
  });
}

}  // namespace field_ros
