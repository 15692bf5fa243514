// What the information filter promises of its matrix: the pattern, the size, the marginals.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <set>

#include "beacon_world.hpp"
#include "vector_field_slam/ekf_solver.hpp"
#include "vector_field_slam/eseif_solver.hpp"

using namespace beacon_world;

namespace {

/// Drives through the cells of a width x height block, row by row, standing in each for some
/// readings.
void visit_block(World& world, Solver& solver, int width, int height) {
  for (int y = 0; y < height; ++y) {
    for (int i = 0; i < width; ++i) {
      const int x = y % 2 == 0 ? i : width - 1 - i;
      const RobotVector r = solver.robot();
      const SE2 pose(r[0], r[1], r[2]);
      const SE2 goal(x + 0.1, y - 0.1,
                     pose.yaw() + 0.3);  // cells have the middle of (0, 0) in theirs
      solver.move(odometry_step(world.odometry, pose, pose.between(goal)), 1e-6);
      world.truth = SE2(solver.robot().head<kPose>());
      for (int k = 0; k < 5; ++k) {
        const auto z = world.measure();
        ASSERT_TRUE(solver.observe(world.mounting, z.data(), static_cast<int>(z.size())).applied);
      }
    }
  }
}

TEST(Sparsity, OnlyNeighboursAndFourActiveNodesShareInformation) {
  World world;
  EseifSolver<M> eseif(world.model, {});
  eseif.start(world.start());
  visit_block(world, eseif, 6, 5);
  ASSERT_EQ(eseif.node_count(), 42);  // the paper's IEC room
  const Eigen::MatrixXd lambda = eseif.information();
  ASSERT_EQ(lambda.rows(), 173);
  std::set<int> active;
  int pairs = 0;
  for (int i = 0; i < 42; ++i) {
    if (!lambda.block(0, kRobot + M * i, kRobot, M).isZero(0.0)) active.insert(i);
    for (int j = 0; j < i; ++j) {
      const bool shared = !lambda.block(kRobot + M * i, kRobot + M * j, M, M).isZero(0.0);
      const GridIndex a = eseif.node_index(i), b = eseif.node_index(j);
      const bool neighbours = std::abs(a.x - b.x) <= 1 && std::abs(a.y - b.y) <= 1;
      EXPECT_TRUE(neighbours || !shared) << i << ", " << j;
      pairs += shared;
    }
  }
  EXPECT_EQ(active.size(), 4u);
  EXPECT_EQ(pairs, 131);  // all neighbours of a 7 x 6 block
  EXPECT_EQ(Eigen::LLT<Eigen::MatrixXd>(lambda).info(), Eigen::Success);
}

TEST(Sparsity, ExtendedKalmanFilterHasTheSameVariables) {
  World world;
  EkfSolver<M> ekf(world.model, 0.0, 1000);
  ekf.start(world.start());
  visit_block(world, ekf, 6, 5);
  EXPECT_EQ(ekf.covariance().rows(), 173);
  EXPECT_EQ(Eigen::LLT<Eigen::MatrixXd>(ekf.covariance()).info(), Eigen::Success);
}

TEST(Marginals, EqualDenseInversionWhereTheRingIsTheWholeMap) {
  World world;
  EseifSolver<M> eseif(world.model, {});
  eseif.start(world.start());
  visit_block(world, eseif, 3, 3);
  // Back into the middle cell, whose ring is all the rest.
  const RobotVector r = eseif.robot();
  const SE2 pose(r[0], r[1], r[2]), goal(1.0, 1.0, 0.5);
  eseif.move(odometry_step(world.odometry, pose, pose.between(goal)), 0.0);
  world.truth = goal;
  const auto z = world.measure();
  ASSERT_TRUE(eseif.observe(world.mounting, z.data(), static_cast<int>(z.size())).applied);
  const Eigen::MatrixXd covariance = eseif.information().inverse();
  ASSERT_EQ(covariance.rows(), kRobot + 16 * M);
  const RobotMatrix robot = covariance.topLeftCorner<kRobot, kRobot>();
  EXPECT_LT((eseif.robot_covariance() - robot).norm(), 1e-9 * robot.norm());
  std::vector<int> nodes;
  for (int j = 0; j < 4; ++j) nodes.push_back(eseif.find(cell_node({1, 1}, j)));
  const Eigen::MatrixXd marginal = eseif.node_covariance(nodes);
  for (int a = 0; a < 4; ++a) {
    for (int b = 0; b < 4; ++b) {
      const Eigen::MatrixXd expected =
          covariance.block(kRobot + M * nodes[a], kRobot + M * nodes[b], M, M);
      EXPECT_LT((marginal.block(M * a, M * b, M, M) - expected).norm(), 1e-9 * covariance.norm());
    }
  }
}

TEST(Marginals, RelocationKeepsTheRobotAndTheMap) {
  World world;
  EseifSolver<M> eseif(world.model, {});
  eseif.start(world.start());
  visit_block(world, eseif, 2, 1);
  const int nodes = eseif.node_count();
  const Eigen::MatrixXd before = eseif.information().inverse();
  // Into the first cell again, with a measurement that says nothing.
  const RobotVector r = eseif.robot();
  const SE2 pose(r[0], r[1], r[2]);
  const OdometryStep<double> step{-1.0, 0.0, 0.0, {}};
  eseif.move(step, 0.0);
  const Observation<double> nothing{0, 0.0, 1e12};
  ASSERT_TRUE(eseif.observe(world.mounting, &nothing, 1).applied);
  ASSERT_EQ(eseif.node_count(), nodes);
  const Eigen::MatrixXd after = eseif.information().inverse();
  const Eigen::Index n = after.rows() - kRobot;
  EXPECT_LT((after.bottomRightCorner(n, n) - before.bottomRightCorner(n, n)).norm(),
            1e-8 * before.norm());
  RobotMatrix moved = before.topLeftCorner<kRobot, kRobot>(), g = RobotMatrix::Identity();
  g(1, 2) = -1.0;  // dx
  moved = g * moved * g.transpose();
  EXPECT_LT((after.topLeftCorner<kRobot, kRobot>() - moved).norm(), 1e-8 * moved.norm());
}

// With the pose known exactly the model is linear in the node values: recursive and direct least
// squares agree.
TEST(Linear, KnownPoseGivesLeastSquares) {
  World world;
  EseifSolver<M> eseif(world.model, {});
  StartState start = world.start();
  start.covariance = RobotVector::Constant(1e-13).asDiagonal();
  eseif.start(start);
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(4 * M, 4 * M);
  Eigen::VectorXd b(4 * M);
  for (int i = 0; i < 4 * M; ++i) {
    a(i, i) = 1.0 / world.model.prior_variance[i % M];
    b[i] = a(i, i) * start.node_values(i % M, i / M);
  }
  double robot[kRobot];
  RobotVector::Map(robot) = start.robot;
  const SE2 step(0.05, 0.02, 0.4);
  for (int t = 0; t < 20; ++t) {
    world.truth = SE2(robot[0], robot[1], robot[2]);
    const SensorPose<double> sensor(robot, world.mounting);
    const Interpolation<double> at(world.model.grid, {0, 0}, sensor.x, sensor.y);
    const auto z = world.measure();
    for (const auto& reading : z) {
      const double zero[M] = {};
      const double* nodes[4] = {zero, zero, zero, zero};
      const auto p = world.model.sensor.predict(reading.channel, sensor, robot + kPose, at, nodes);
      double row[kRobot + 4 * M];
      local_row<double, M>(p, at, reading.channel, row);
      const Eigen::Map<const Eigen::VectorXd> h(row + kRobot, 4 * M);
      a += h * h.transpose() / reading.variance;
      b += h * (reading.value - p.value) / reading.variance;  // p.value: the offset alone
    }
    ASSERT_TRUE(eseif.observe(world.mounting, z.data(), static_cast<int>(z.size())).applied);
    const SE2 next = world.truth * step;
    eseif.move({next.x() - robot[0], next.y() - robot[1], step.yaw(), {}}, 0.0);
    Eigen::Vector3d::Map(robot) = next.vector();
  }
  const Eigen::VectorXd expected = a.ldlt().solve(b);
  for (int j = 0; j < 4; ++j) {
    for (int i = 0; i < M; ++i) {
      EXPECT_NEAR(eseif.node_values(j)[i], expected[j * M + i], 1e-9);
    }
  }
  EXPECT_LT((eseif.node_covariance({0, 1, 2, 3}) - a.inverse()).norm(), 1e-9);
}

}  // namespace
