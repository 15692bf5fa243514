#include "field_ros/publishers.hpp"

#include <algorithm>

#include "field_ros/convert.hpp"
#include "field_ros/vector_markers.hpp"

namespace field_ros {

PredictedGrid predict_grid(const Session& session) {
  const AnyEstimator& estimator = session.estimator();
  PredictedGrid map;
  map.grid = FieldGrid::cover(estimator.map_region(), session.params().map_resolution);
  map.fields = estimator.fields();
  map.prediction = estimator.predict_field(map.grid.centres());
  map.stamp = session.stamp();
  map.frame = session.params().global_frame_id;
  return map;
}

field_msgs::HyperparameterPosterior to_message(
    const field_core::HyperparameterPosterior& posterior) {
  field_msgs::HyperparameterPosterior message;
  message.field = posterior.field;
  message.names = posterior.names;
  message.values.assign(posterior.values.data(), posterior.values.data() + posterior.values.size());
  message.probability.assign(posterior.probability.data(),
                             posterior.probability.data() + posterior.probability.size());
  return message;
}

MapPublishers::MapPublishers(ros::NodeHandle& handle, const Session& session) : session_(session) {
  cloud_ = handle.advertise<sensor_msgs::PointCloud2>("cloud", 1, true);
  vectors_ = handle.advertise<visualization_msgs::MarkerArray>("vectors", 10);
  if (!session.estimator().hyperparameters().empty()) {
    const auto fields = static_cast<std::uint32_t>(session.estimator().fields().size());
    hyperparameters_ = handle.advertise<field_msgs::HyperparameterPosterior>(
        "hyperparameters", std::max(10u, 2 * fields));
  }
  advertise_field_map(handle);
  for (const auto& field : session.estimator().fields()) {
    for (const std::string& name : {field.name, field.name + "_stddev"}) {
      grids_[name] = handle.advertise<nav_msgs::OccupancyGrid>("grid/" + name, 1, true);
    }
  }
}

// All fields come on one topic, of which ROS would latch the last message only: a late subscriber
// gets the newest map of each.
void MapPublishers::advertise_field_map(ros::NodeHandle& handle) {
  const std::size_t fields = session_.estimator().fields().size();
  const auto round = static_cast<std::uint32_t>(std::max<std::size_t>(10, 2 * fields));
  field_map_ = handle.advertise<field_msgs::FieldMap>(
      "field_map", round, [this](const ros::SingleSubscriberPublisher& subscriber) {
        for (const auto& map : latched_) subscriber.publish(map);
      });
}

bool MapPublishers::wanted() const {
  if (latched_.empty()) return true;
  for (const ros::Publisher& publisher : {field_map_, cloud_, vectors_}) {
    if (publisher.getNumSubscribers() > 0) return true;
  }
  return std::any_of(grids_.begin(), grids_.end(),
                     [](const auto& grid) { return grid.second.getNumSubscribers() > 0; });
}

void MapPublishers::publish_hyperparameters() {
  if (!hyperparameters_ || hyperparameters_.getNumSubscribers() == 0) return;
  for (const auto& posterior : session_.estimator().hyperparameters()) {
    field_msgs::HyperparameterPosterior message = to_message(posterior);
    message.header.stamp = to_ros(session_.stamp());
    message.header.frame_id = session_.params().global_frame_id;
    hyperparameters_.publish(message);
  }
}

void MapPublishers::publish() {
  publish_hyperparameters();
  if (!wanted()) return;
  const PredictedGrid map = predict_grid(session_);
  latched_.clear();
  for (std::size_t f = 0; f < map.fields.size(); ++f) {
    latched_.push_back(to_field_map(map, f));
    field_map_.publish(latched_.back());
    grids_.at(map.fields[f].name).publish(to_occupancy_grid(map, f, false));
    grids_.at(map.fields[f].name + "_stddev").publish(to_occupancy_grid(map, f, true));
  }
  cloud_.publish(to_point_cloud(map));
  visualization_msgs::MarkerArray vectors = to_vector_markers(map);
  delete_missing(drawn_vectors_, vectors);
  if (!vectors.markers.empty()) vectors_.publish(vectors);
  drawn_vectors_ = std::move(vectors);
}

}  // namespace field_ros
