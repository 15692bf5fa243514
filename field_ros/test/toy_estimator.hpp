// Dead reckoning over a constant field: small enough to check by hand.
#pragma once

#include <chrono>
#include <thread>

#include "field_core/errors.hpp"
#include "field_core/estimator.hpp"
#include "field_core/params.hpp"

namespace field_ros_test {

struct ToyParams {
  std::string field = "light";
  double prior_stddev = 2.0;
  double noise_stddev = 0.5;
  double initial_pose_x = 0.0;
  double step_time = 0.0;
  std::vector<double> region = {-1.0, -2.0, 3.0, 2.0};

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("field", field, "name of the one field");
    v.number("prior_stddev", prior_stddev, field_core::positive(), "lx", "of the constant");
    v.required("noise_stddev")
        .number("noise_stddev", noise_stddev, field_core::positive(), "lx", "of a measurement");
    v.number("initial_pose_x", initial_pose_x, field_core::any_number(), "m", "start");
    v.number("step_time", step_time, field_core::non_negative(), "s", "an update takes this long");
    v.numbers("region", region, {4, 4}, field_core::any_number(), "m", "area of the map");
  }
  void validate() const {
    if (region[0] >= region[2]) {
      throw field_core::ParameterError("region", "is empty; x_min must be below x_max");
    }
  }
};

/// The field is one unknown constant, estimated by the scalar Kalman filter; the pose is odometry
/// with 0.01 m^2 (rad^2) added per step. A reading above 1000 is skipped, one below -1000 is an
/// error.
class ToyEstimator {
 public:
  using Params = ToyParams;
  static constexpr const char* kName = "toy";

  ToyEstimator(const Params& params, std::uint64_t) : params_(params) {
    fields_.push_back({params.field, "lx"});
    reset();
  }
  void predict(const field_core::OdometryIncrement& increment) {
    belief_.mean = belief_.mean * increment.delta;
    belief_.stamp = increment.to;
    belief_.covariance += 0.01 * Eigen::Matrix3d::Identity();
  }
  field_core::UpdateResult update(const field_core::Sample& sample) {
    std::this_thread::sleep_for(std::chrono::duration<double>(params_.step_time));
    const field_core::Reading& r = sample.readings.at(0);
    if (r.value > 1000.0) return field_core::UpdateResult::skipped("too_bright");
    if (r.value < -1000.0) throw field_core::NumericalError("the toy cannot go that dark");
    const double noise = r.variance > 0.0 ? r.variance : noise_variance();
    const double s = variance_ + noise, d = r.value - mean_;
    mean_ += variance_ / s * d;
    variance_ *= noise / s;
    last_place_ = belief_.mean * sample.sensor_in_base;
    return {true, "", d * d / s, 1};
  }
  field_core::Belief belief() const { return belief_; }
  field_core::FieldPrediction predict_field(const Eigen::Matrix2Xd& points) const {
    return {Eigen::MatrixXd::Constant(1, points.cols(), mean_),
            Eigen::MatrixXd::Constant(1, points.cols(), variance_ + noise_variance()),
            Eigen::VectorXd::Constant(
                1, params_.prior_stddev * params_.prior_stddev + noise_variance())};
  }
  const std::vector<field_core::FieldInfo>& fields() const { return fields_; }
  field_core::MapRegion map_region() const {
    return {params_.region[0], params_.region[1], params_.region[2], params_.region[3]};
  }
  void set_pose(const field_core::SE2& pose, const Eigen::Matrix3d& covariance) {
    belief_.mean = pose;
    belief_.covariance = covariance;
  }
  void scatter() { belief_.covariance = 100.0 * Eigen::Matrix3d::Identity(); }
  void reset() {
    belief_ = {};
    belief_.mean = field_core::SE2(params_.initial_pose_x, 0.0, 0.0);
    mean_ = 0.0;
    variance_ = params_.prior_stddev * params_.prior_stddev;
  }
  field_core::State state() const {
    field_core::State state(kName, 1);
    state.set("field", Eigen::Vector2d(mean_, variance_));
    state.set("pose", belief_.mean.vector());
    state.set("covariance", belief_.covariance);
    return state;
  }
  void restore(const field_core::State& state) {
    state.require(kName, 1);
    const Eigen::MatrixXd field = state.matrix("field", 2, 1), pose = state.matrix("pose", 3, 1);
    belief_.covariance = state.matrix("covariance", 3, 3);
    mean_ = field(0);
    variance_ = field(1);
    belief_.mean = field_core::SE2(Eigen::Vector3d(pose));
  }
  static std::vector<std::string> run_parameters() { return {"step_time"}; }
  /// Where the sensor of the last update stood; static: tests cannot reach the held estimator.
  static inline field_core::SE2 last_place_;

 private:
  double noise_variance() const { return params_.noise_stddev * params_.noise_stddev; }

  Params params_;
  std::vector<field_core::FieldInfo> fields_;
  field_core::Belief belief_;
  double mean_ = 0.0, variance_ = 1.0;
};

}  // namespace field_ros_test
