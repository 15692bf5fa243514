// The information filter against the covariance filter, and against what theory says of both.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <memory>

#include "beacon_world.hpp"
#include "dense_reference.hpp"
#include "vector_field_slam/ekf_solver.hpp"
#include "vector_field_slam/eseif_solver.hpp"

using namespace beacon_world;

namespace {

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

class Equivalence : public ::testing::TestWithParam<double> {};

TEST_P(Equivalence, InformationFormEqualsCovarianceFormWithinACell) {
  World world;
  EkfSolver<M> ekf(world.model, 0.0, 1000, GetParam());
  EseifOptions options;
  options.underweighting = GetParam();
  EseifSolver<M> eseif(world.model, options);
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

INSTANTIATE_TEST_SUITE_P(Underweighting, Equivalence, ::testing::Values(0.0, 4.0));

struct Variant {
  const char* name;
  Relocation relocation;
  int rings;
};

class SparseFilter : public ::testing::TestWithParam<Variant> {};

// A loop through nine cells, twice, so that cells are entered again; then the filter against the
// paper's equations on dense matrices.
TEST_P(SparseFilter, EqualsThePapersEquations) {
  World world;
  EseifOptions options;
  options.relocation = GetParam().relocation;
  options.rings = GetParam().rings;
  options.relocation_variance << 0.0025, 0.0025, 0.0025, 0.0001, 0.0001;
  EseifSolver<M> eseif(world.model, options);
  dense_reference::Filter<M> reference{world.model, options.relocation, options.rings};
  reference.r0 = options.relocation_variance;
  const StartState start = world.start();
  eseif.start(start);
  reference.start(start);
  for (int t = 0; t < 150; ++t) {
    const SE2 delta(0.1, 0.01, 0.085);  // a circle of 1.2 m radius
    world.truth = world.truth * delta;
    const RobotVector r = eseif.robot();
    const auto step = odometry_step(world.odometry, SE2(r[0], r[1], r[2]), delta);
    const auto z = world.measure();
    eseif.move(step, 0.0);
    ASSERT_TRUE(eseif.observe(world.mounting, z.data(), static_cast<int>(z.size())).applied);
    reference.move(step);
    reference.observe(world.mounting, z);
    ASSERT_EQ(eseif.node_count(), static_cast<int>(reference.nodes.size()));
    RobotVector difference = eseif.robot() - reference.mu.head<kRobot>();
    difference[2] = field_core::wrap_angle(difference[2]);
    ASSERT_LT(difference.norm(), 1e-7) << "step " << t;
    ASSERT_LT((eseif.robot_covariance() - reference.robot_covariance).norm(), 1e-8);
  }
  EXPECT_GT(eseif.node_count(), 12);
}

INSTANTIATE_TEST_SUITE_P(All, SparseFilter,
                         ::testing::Values(Variant{"paper", Relocation::blank, 0},
                                           Variant{"blank_ring", Relocation::blank, 1},
                                           Variant{"shared", Relocation::shared_nodes, 0},
                                           Variant{"shared_ring", Relocation::shared_nodes, 1},
                                           Variant{"shared_rings", Relocation::shared_nodes, 2},
                                           Variant{"window_ring", Relocation::window, 1},
                                           Variant{"window_rings", Relocation::window, 2}),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
