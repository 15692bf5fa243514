#include "field_ros/node.hpp"

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <tf2_ros/transform_listener.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>

#include "field_ros/bag_transforms.hpp"
#include "field_ros/diagnostics.hpp"
#include "field_ros/program.hpp"
#include "field_ros/publishers.hpp"
#include "field_ros/reconfigure.hpp"
#include "field_ros/sensors.hpp"
#include "field_ros/services.hpp"
#include "field_ros/session.hpp"
#include "field_ros/state_keeper.hpp"

namespace field_ros {
namespace {

// Of wall time: they must come when the clock stands. (diagnostic_updater goes by ROS time.)
constexpr double kDiagnosticsPeriod = 1.0;  // [s]
constexpr double kIdleWait = 0.1;           // [s] between looks at ros::ok()

double steady_now() { return ros::SteadyTime::now().toSec(); }

class Node {
 public:
  explicit Node(Configured configured)
      : private_("~"),
        listener_(buffer_),
        session_(std::move(configured),
                 [this](const std::string& frame, field_core::Stamp stamp) {
                   return lookup_placement(buffer_, session_.params().base_frame_id, frame, stamp);
                 }),
        keeper_(session_),
        publishers_(private_, session_),
        services_(handle_, private_, session_, [this] { on_replaced(); }),
        reconfigure_(private_, session_.params(), [this](const RuntimeParams& p) { change(p); }) {
    session_.set_listener([this](const SessionStep& step) { on_step(step); });
    session_.defer_steps();
    diagnostics_ = handle_.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 10);
    last_odometry_ = last_measurement_ = last_step_ = steady_now();
    subscribe();
    before_ = snapshot();
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
    }
    keeper_.finish();
  }

 private:
  void subscribe() {
    const NodeParams& params = session_.params();
    const auto odom_queue = static_cast<std::uint32_t>(params.odom_queue_size);
    const auto field_queue = static_cast<std::uint32_t>(params.field_queue_size);
    subscribers_.push_back(handle_.subscribe("odom", odom_queue, &Node::on_odometry, this));
    subscribers_.push_back(handle_.subscribe("field", field_queue, &Node::on_field, this));
    subscribers_.push_back(handle_.subscribe("initialpose", 2, &Node::on_initialpose, this));
    for (const auto& entry : params.sensors) {
      const SensorParams sensor = entry.second;
      with_sensor_message(sensor.type, [&](auto* type) {
        using Message = std::remove_pointer_t<decltype(type)>;
        const boost::function<void(const boost::shared_ptr<const Message>&)> callback =
            [this, sensor](const boost::shared_ptr<const Message>& message) {
              on_field(to_field(*message, sensor));
            };
        subscribers_.push_back(handle_.subscribe<Message>(sensor.topic, field_queue, callback));
      });
    }
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

  void on_field(const field_msgs::FieldMeasurement& message) {
    last_measurement_ = steady_now();
    session_.on_field(message);
  }

  void on_odometry(const nav_msgs::Odometry& message) {
    last_odometry_ = steady_now();
    const std::uint64_t resets = session_.counts().clock_resets;
    session_.on_odometry(message);
    if (session_.counts().clock_resets > resets) {
      ROS_WARN("time went back: the estimator and its map start again");
      buffer_.clear();
      publishers_.clear_path();
    }
    publishers_.publish_transform();
  }

  void on_initialpose(const geometry_msgs::PoseWithCovarianceStamped& message) {
    if (session_.on_initialpose(message)) on_replaced();
  }

  void on_step(const SessionStep& step) {
    last_step_ = steady_now();
    step_time_sum_ += step.step_s;
    step_time_max_ = std::max(step_time_max_, step.step_s);
    publishers_.publish_belief();
  }

  void on_replaced() {
    publishers_.clear_path();
    publishers_.publish_belief();
    publishers_.publish_transform();
  }

  void draw() {
    try {
      publishers_.publish_maps();
    } catch (const field_core::NumericalError& e) {
      ROS_WARN_THROTTLE(10.0, "no field map: %s", e.what());
    }
  }

  HealthSnapshot snapshot() const {
    HealthSnapshot now;
    now.time_s = steady_now();
    now.counts = session_.counts();
    now.step_time_sum_s = step_time_sum_;
    now.step_time_max_s = step_time_max_;
    now.since_odometry_s = now.time_s - last_odometry_;
    now.since_measurement_s = now.time_s - last_measurement_;
    now.since_step_s = now.time_s - last_step_;
    now.input_timeout_s = session_.params().input_timeout;
    now.health = session_.health();
    now.recent_nis = session_.recent_nis();
    now.waiting_for_transform = session_.waiting_for_transform();
    now.states_saved = keeper_.saved();
    now.save_problem = keeper_.problem();
    now.belief = session_.belief();
    now.pending = session_.pending();
    now.paused = session_.paused();
    now.last_error = session_.last_error();
    return now;
  }

  void report() {
    HealthSnapshot now = snapshot();
    diagnostic_msgs::DiagnosticArray message =
        diagnose(ros::this_node::getName().substr(1), before_, now);
    message.header.stamp = ros::Time::now();
    diagnostics_.publish(message);
    before_ = std::move(now);
    step_time_max_ = 0.0;
  }

  ros::NodeHandle handle_, private_;
  tf2_ros::Buffer buffer_;
  tf2_ros::TransformListener listener_;
  Session session_;
  StateKeeper keeper_;
  Publishers publishers_;
  Services services_;
  Reconfigure reconfigure_;
  ros::Publisher diagnostics_;
  std::vector<ros::Subscriber> subscribers_;
  ros::WallTimer report_timer_, map_timer_;
  HealthSnapshot before_;
  double step_time_sum_ = 0.0, step_time_max_ = 0.0;
  double last_odometry_ = 0.0, last_measurement_ = 0.0, last_step_ = 0.0;  // steady clock [s]
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
    Node node(configure(entry));
    node.spin();
    return kExitOk;
  });
}

}  // namespace field_ros
