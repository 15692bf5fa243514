// Beacons over a field that the grid represents, and a robot driven by hand: for tests of solvers.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "field_core/random.hpp"
#include "vector_field_slam/solver.hpp"

namespace beacon_world {

using namespace vector_field_slam;
using field_core::SE2;

constexpr int M = 4;

inline VectorFieldSlamParams beacon_params() {
  VectorFieldSlamParams p;
  p.sensor_model = SensorModelType::beacon_pairs;
  for (const char* name : {"a_x", "a_y", "b_x", "b_y"}) p.channels[name].noise_stddev = 0.05;
  return p;
}

struct World {
  VectorFieldSlamParams params = beacon_params();
  Model<M> model{params, make_channels(params)};
  field_core::OdometryMotionModel odometry{{0.01, 0.01, 0.02, 0.01}};
  field_core::Random random{11};
  Mounting<double> mounting{0.05, 0.02, 0.1};
  SE2 truth;

  StartState start() const {
    StartState s;
    s.robot << 0.02, -0.03, 0.1, 0.01, -0.02;
    s.covariance = RobotVector(0.01, 0.02, 0.03, 0.0025, 0.0025).asDiagonal();
    s.cell = {0, 0};
    s.node_values.resize(M, 4);
    for (int j = 0; j < 4; ++j) s.node_values.col(j) = field(j & 1, j >> 1).array() + 0.1 * (j - 1);
    return s;
  }
  static Eigen::Vector4d field(double x, double y) {
    return {0.5 - 0.4 * x, 0.3 - 0.4 * y, -0.2 - 0.4 * x + 0.05 * x * y, 0.1 - 0.4 * y};
  }
  /// What the sensor reads; a channel is missing now and then.
  std::vector<Observation<double>> measure() {
    const double robot[kRobot] = {truth.x(), truth.y(), truth.yaw(), 0.03, -0.02};
    const SensorPose<double> sensor(robot, mounting);
    const Eigen::Vector4d m = field(sensor.x, sensor.y);
    const double c = sensor.cos_yaw, s = sensor.sin_yaw;
    std::vector<Observation<double>> z;
    for (int i = 0; i < M; i += 2) {
      z.push_back({i, c * m[i] + s * m[i + 1] + 0.03 + random.normal(0.0, 0.02), 0.0025});
      z.push_back({i + 1, -s * m[i] + c * m[i + 1] - 0.02 + random.normal(0.0, 0.02), 0.003});
    }
    z.resize(1 + random.index(M));
    return z;
  }
};

}  // namespace beacon_world
