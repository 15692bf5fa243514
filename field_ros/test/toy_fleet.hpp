// Toy estimators that share a field: what the steps of several robots do, in which order.
#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "field_ros/session.hpp"
#include "toy_estimator.hpp"

namespace field_ros_test {

struct ToyFleetParams : ToyParams {
  std::vector<std::string> robots = {"anna", "bert"};

  template <class Visitor>
  void visit(Visitor& v) {
    ToyParams::visit(v);
    v.texts("robots", robots, "names");
  }
};

/// Each robot is a ToyEstimator (the field is the first one's); positions set the pose.
class ToyFleet {
 public:
  using Params = ToyFleetParams;
  using UpdateResult = field_core::UpdateResult;
  static constexpr const char* kName = "toy_fleet";

  ToyFleet(const Params& params, std::uint64_t seed)
      : names_(params.robots), toys_(params.robots.size(), ToyEstimator(params, seed)) {}
  const std::vector<std::string>& robots() const { return names_; }
  void predict(const field_core::OdometryIncrement& increment, int robot = 0) {
    log_.emplace_back(robot, std::round(1e3 * field_core::to_seconds(increment.to)) / 1e3);
    toy(robot).predict(increment);
  }
  UpdateResult update(const field_core::Sample& sample, int robot = 0) {
    return toy(robot).update(sample);
  }
  UpdateResult observe_position(const field_core::PositionObservation& seen, int robot = 0) {
    const field_core::SE2 pose(seen.position.x(), seen.position.y(), 0.0);
    toy(robot).set_pose(pose, Eigen::Matrix3d::Identity());
    return {true, "", 0.5, 2};
  }
  field_core::Belief belief(int robot = 0) const {
    return toys_[static_cast<std::size_t>(robot)].belief();
  }
  field_core::FieldPrediction predict_field(const Eigen::Matrix2Xd& points) const {
    return toys_[0].predict_field(points);
  }
  const std::vector<field_core::FieldInfo>& fields() const { return toys_[0].fields(); }
  field_core::MapRegion map_region() const { return toys_[0].map_region(); }
  void set_pose(const field_core::SE2& pose, const Eigen::Matrix3d& covariance, int robot = 0) {
    toy(robot).set_pose(pose, covariance);
  }
  void scatter(int robot = 0) { toy(robot).scatter(); }
  void reset() {
    ++resets_;
    for (ToyEstimator& toy : toys_) toy.reset();
  }
  field_core::State state() const { return field_core::State(kName, 1); }
  void restore(const field_core::State& state) { state.require(kName, 1); }

  /// (robot, stamp) of each step; static: tests cannot reach the held estimator.
  static inline std::vector<std::pair<int, double>> log_;
  static inline int resets_ = 0;

 private:
  ToyEstimator& toy(int robot) { return toys_[static_cast<std::size_t>(robot)]; }

  std::vector<std::string> names_;
  std::vector<ToyEstimator> toys_;
};

inline field_ros::Session make_fleet(const std::string& extra = "") {
  ToyFleet::log_.clear();
  ToyFleet::resets_ = 0;
  const auto entry = field_ros::estimator_entry<ToyFleet>();
  return field_ros::Session(
      entry.make(field_ros::ParamTree::from_yaml_text("noise_stddev: 0.5\n" + extra, "fleet.yaml"),
                 std::nullopt),
      [](const std::string& base, const std::string& frame, field_core::Stamp) {
        return frame == base + "_mast"
                   ? std::optional<field_core::SE2>(field_core::SE2(0.0, 2.0, 0.0))
                   : std::nullopt;
      });
}

}  // namespace field_ros_test
