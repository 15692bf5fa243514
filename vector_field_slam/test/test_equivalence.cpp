// The information filter against the covariance filter, and against what theory says of both.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <memory>

#include "field_core/random.hpp"
#include "vector_field_slam/ekf_solver.hpp"
#include "vector_field_slam/eseif_solver.hpp"

using namespace vector_field_slam;
using field_core::SE2;

namespace {

constexpr int M = 4;

VectorFieldSlamParams beacon_params() {
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
    s.node_values = Eigen::MatrixXd::Random(M, 4);
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

/// The robot drives `delta` per step; both solvers take the same steps and readings.
void drive(World& world, Solver& a, Solver* b, SE2 delta, int steps) {
  for (int t = 0; t < steps; ++t) {
    world.truth = world.truth * delta;
    const SE2 pose(a.robot()[0], a.robot()[1], a.robot()[2]);
    const auto step = odometry_step(world.odometry, pose, delta);
    const auto z = world.measure();
    for (Solver* solver : {&a, b}) {
      if (!solver) continue;
      solver->move(step, 1e-6);
      const auto result = solver->observe(world.mounting, z.data(), static_cast<int>(z.size()));
      ASSERT_TRUE(result.applied) << result.reason;
    }
  }
}

TEST(Equivalence, InformationFormEqualsCovarianceFormWithinACell) {
  World world;
  EkfSolver<M> ekf(world.model, 0.0, 1000);
  EseifSolver<M> eseif(world.model, {});
  const StartState start = world.start();
  ekf.start(start);
  eseif.start(start);
  drive(world, ekf, &eseif, SE2(0.03, 0.0, 0.25), 60);  // a circle of 0.12 m: one cell
  ASSERT_EQ(ekf.node_count(), 4);
  EXPECT_LT((ekf.robot() - eseif.robot()).norm(), 1e-9);
  for (int j = 0; j < 4; ++j) {
    for (int i = 0; i < M; ++i) {
      EXPECT_NEAR(ekf.node_values(j)[i], eseif.node_values(j)[i], 1e-9);
    }
  }
  EXPECT_LT((ekf.robot_covariance() - eseif.robot_covariance()).norm(), 1e-9);
  EXPECT_LT((ekf.node_covariance({0, 1, 2, 3}) - eseif.node_covariance({0, 1, 2, 3})).norm(), 1e-9);
  EXPECT_LT((eseif.information() * ekf.covariance() - Eigen::MatrixXd::Identity(21, 21)).norm(),
            1e-6);  // the condition number of the product's factors is about 1e5
}

}  // namespace
