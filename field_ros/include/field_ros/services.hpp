// The services of a node. A request that cannot be met is answered with success: false and the
// reason.
#pragma once

#include <field_msgs/LoadState.h>
#include <field_msgs/PredictField.h>
#include <field_msgs/SaveState.h>
#include <ros/node_handle.h>
#include <std_srvs/Empty.h>
#include <std_srvs/SetBool.h>

#include <functional>
#include <vector>

#include "field_ros/session.hpp"

namespace field_ros {

/// Points that one ~predict_field call may ask for.
constexpr std::size_t kMostPredictedPoints = 1000000;

/// Answers without a ROS node, for tests.
field_msgs::PredictField::Response predict_field(const AnyEstimator& estimator,
                                                 const field_msgs::PredictField::Request& request);
field_msgs::SaveState::Response save_state(const Session& session, const std::string& name);
field_msgs::LoadState::Response load_state(Session& session, const std::string& name);

class Services {
 public:
  /// @param on_change called after the pose or the map has been replaced by a service
  Services(ros::NodeHandle& handle, ros::NodeHandle& private_handle, Session& session,
           std::function<void()> on_change);

 private:
  std::vector<ros::ServiceServer> servers_;
};

}  // namespace field_ros
