// What a node publishes of a session: of each robot its pose and map -> odom, of all robots the
// maps.
#pragma once

#include <field_msgs/HyperparameterPosterior.h>
#include <nav_msgs/Path.h>
#include <ros/node_handle.h>
#include <tf2_ros/transform_broadcaster.h>

#include <deque>
#include <map>
#include <string>
#include <vector>

#include "field_ros/map_messages.hpp"
#include "field_ros/session.hpp"

namespace field_ros {

/// Prediction of all fields on the estimator's map region. @throws NumericalError
PredictedGrid predict_grid(const Session& session);

field_msgs::HyperparameterPosterior to_message(
    const field_core::HyperparameterPosterior& posterior);

/// ~pose, ~path, ~particlecloud, ~candidates, ~vectors and /tf of one robot; of several, in a
/// namespace with its name.
class RobotPublishers {
 public:
  RobotPublishers(ros::NodeHandle& private_handle, const Session& session, int robot);

  /// After a step.
  void publish_belief();
  /// map -> odom, post-dated by transform_tolerance; call on each odometry message.
  void publish_transform();
  void clear_path() { path_.clear(); }

 private:
  void publish_path(const field_core::Belief& belief);
  void publish_particles(const field_core::Belief& belief);

  const Session& session_;
  int robot_;
  ros::Publisher pose_, path_publisher_, particles_, candidates_, vectors_;
  tf2_ros::TransformBroadcaster broadcaster_;
  std::deque<geometry_msgs::PoseStamped> path_;
  field_core::Stamp transform_stamp_{-1};
};

/// ~field_map, ~grid/..., ~cloud, ~hyperparameters, and vector fields on ~vectors.
class MapPublishers {
 public:
  MapPublishers(ros::NodeHandle& private_handle, const Session& session);

  /// Only if somebody listens or nothing is latched yet.
  void publish();

 private:
  bool wanted() const;
  void advertise_field_map(ros::NodeHandle& handle);
  void publish_hyperparameters();

  const Session& session_;
  ros::Publisher field_map_, cloud_, vectors_, hyperparameters_;
  std::map<std::string, ros::Publisher> grids_;
  /// The newest map of each field, for subscribers to come; empty: none is drawn yet.
  std::vector<field_msgs::FieldMap> latched_;
  visualization_msgs::MarkerArray drawn_vectors_;
};

}  // namespace field_ros
