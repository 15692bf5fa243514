// The batch solver against numerical derivatives, a dense inverse, the EKF and the truth.
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "grid_world.hpp"
#include "vector_field_slam/batch_optimizer.hpp"
#include "vector_field_slam/ekf_solver.hpp"

using namespace vector_field_slam;
using field_core::SE2;
using grid_world::World;

namespace {

constexpr int M = World::M;

/// All variables as one vector, and back.
Eigen::VectorXd variables(const BatchProblem<M>& p) {
  Eigen::VectorXd v(p.variables());
  Eigen::Index at = 0;
  for (const auto& x : p.poses) v.segment<3>(at) = x, at += 3;
  for (const auto& x : p.nodes) v.segment<M>(at) = x, at += M;
  v.tail<2>() = p.offset;
  return v;
}
void set_variables(BatchProblem<M>& p, const Eigen::VectorXd& v) {
  Eigen::Index at = 0;
  for (auto& x : p.poses) x = v.segment<3>(at), at += 3;
  for (auto& x : p.nodes) x = v.segment<M>(at), at += M;
  p.offset = v.tail<2>();
}

World small_world(int samples = 60) {
  grid_world::Options options;
  World world(options, 3);
  world.drive(samples);
  return world;
}

TEST(Batch, GradientEqualsDifferencesOfTheCost) {
  World world = small_world();
  auto& problem = world.log.problem();
  BatchOptimizer<M> optimizer(world.model);
  const Eigen::VectorXd gradient = optimizer.gradient(problem), at = variables(problem);
  BatchProblem<M> moved = problem;
  for (Eigen::Index i = 0; i < at.size(); ++i) {
    const double h = 1e-6;
    Eigen::VectorXd v = at;
    v[i] += h;
    set_variables(moved, v);
    const double up = optimizer.cost(moved);
    v[i] -= 2.0 * h;
    set_variables(moved, v);
    const double difference = (up - optimizer.cost(moved)) / (2.0 * h);
    // Central differences of a cost near 1e5 are good to about 1e5 * 1e-16 / h = 1e-5, plus h^2
    // times third derivatives of up to 1e8.
    EXPECT_NEAR(gradient[i], difference, 1e-3 + 1e-5 * std::abs(gradient[i])) << "variable " << i;
  }
}

TEST(Batch, NothingNearTheSolutionIsBetter) {
  World world = small_world(200);
  auto& problem = world.log.problem();
  BatchOptimizer<M> optimizer(world.model);
  const auto report = optimizer.optimize(problem, {200, 1e-9});
  EXPECT_TRUE(report.converged);
  EXPECT_LT(report.cost, report.initial_cost);
  EXPECT_NEAR(report.cost, optimizer.cost(problem), 1e-9 * report.cost);
  const Eigen::VectorXd at = variables(problem);
  BatchProblem<M> moved = problem;
  field_core::Random random(7);
  for (int trial = 0; trial < 200; ++trial) {
    Eigen::VectorXd v = at;
    for (Eigen::Index i = 0; i < v.size(); ++i) v[i] += random.normal(0.0, 1e-3);
    set_variables(moved, v);
    EXPECT_GT(optimizer.cost(moved), report.cost);
  }
}

TEST(Batch, CostsNoMoreThanTheTruthAndIsCloserThanTheOnlineFilter) {
  World world = small_world(400);
  auto truth = world.log.problem();
  double online = 0.0, batch = 0.0;
  for (std::size_t t = 0; t < truth.poses.size(); ++t) {
    online += (truth.poses[t].head<2>() - world.poses[t].translation()).norm();
    truth.poses[t] = world.poses[t].vector();
  }
  for (int i = 0; i < truth.table.size(); ++i) {
    const GridIndex index = truth.table.index(i);
    truth.nodes[i] = world.field(world.model.grid.node_x(index), world.model.grid.node_y(index));
  }
  truth.offset = {0.03, -0.02};
  BatchOptimizer<M> optimizer(world.model);
  auto problem = world.log.problem();
  const auto report = optimizer.optimize(problem);
  EXPECT_LT(report.cost, optimizer.cost(truth));
  // Half of chi^2 with as many degrees of freedom as residuals exceed variables: 400 samples of 4
  // readings, which the poses and the map of about 36 nodes do not take up.
  const double freedom = M * 400.0 - 2.0;
  EXPECT_NEAR(2.0 * report.cost, freedom, 0.2 * freedom);
  for (std::size_t t = 0; t < problem.poses.size(); ++t) {
    batch += (problem.poses[t].head<2>() - world.poses[t].translation()).norm();
  }
  const auto poses = static_cast<double>(problem.poses.size());
  std::printf("mean position error: online %.4f m, batch %.4f m\n", online / poses, batch / poses);
  EXPECT_LT(batch, online);
}

TEST(Batch, MarginalCovariancesAreThoseOfTheDenseInverse) {
  World world = small_world();
  auto& problem = world.log.problem();
  BatchOptimizer<M> optimizer(world.model);
  optimizer.optimize(problem);
  const Eigen::SparseMatrix<double> lower = optimizer.information(problem);
  const Eigen::MatrixXd dense = Eigen::MatrixXd(lower).selfadjointView<Eigen::Lower>();
  const Eigen::MatrixXd inverse =
      dense.ldlt().solve(Eigen::MatrixXd::Identity(dense.rows(), dense.cols()));
  std::vector<int> wanted;
  for (int i = 0; i < 3; ++i) wanted.push_back(BatchOptimizer<M>::pose_variable(40) + i);
  for (int i = 0; i < M; ++i) wanted.push_back(BatchOptimizer<M>::node_variable(problem, 5) + i);
  for (int i = 0; i < 2; ++i) wanted.push_back(BatchOptimizer<M>::offset_variable(problem) + i);
  const Eigen::MatrixXd covariance = optimizer.covariance(problem, wanted);
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    for (std::size_t j = 0; j < wanted.size(); ++j) {
      const double scale = std::sqrt(inverse(wanted[i], wanted[i]) * inverse(wanted[j], wanted[j]));
      EXPECT_NEAR(covariance(i, j), inverse(wanted[i], wanted[j]), 1e-6 * scale);
    }
  }
}

/// With the poses known (to 1e-6 m), the model is linear in nodes and offset, and both solvers must
/// give the same estimate, new nodes included.
TEST(Batch, EqualsTheEkfWhereTheModelIsLinear) {
  const double tight = 1e-12;  // variance of the start and of a step [m^2, rad^2]
  const VectorFieldSlamParams params = grid_world::params({});
  const Model<M> model(params, make_channels(params));
  EkfSolver<M> ekf(model, 0.0, 1000);
  BatchLog<M> log(model);
  StartState start;
  start.robot.setZero();
  start.covariance = RobotVector(tight, tight, tight, 2.5e-3, 2.5e-3).asDiagonal();
  start.cell = {0, 0};
  start.node_values = Eigen::MatrixXd::Zero(M, 4);
  ekf.start(start);
  log.start(start);
  field_core::Random random(5);
  SE2 pose;
  for (int t = 0; t < 40; ++t) {
    const SE2 next = pose * SE2(0.2, 0.0, 0.1);
    OdometryStep<double> step{next.x() - pose.x(), next.y() - pose.y(), 0.1, {}};
    for (int i = 0; i < 3; ++i) step.noise[i][i] = tight;
    log.move(ekf.robot().head<3>(), step);
    ekf.move(step, 0.0);
    pose = next;
    Observation<double> z[M];
    for (int i = 0; i < M; ++i) z[i] = {i, random.normal(0.0, 0.3), 0.01 + 0.001 * i};
    ASSERT_TRUE(ekf.observe({}, z, M).applied);
    log.observe({}, z, M, ekf);
  }
  auto& problem = log.problem();
  for (auto& node : problem.nodes) node.setZero();
  BatchOptimizer<M> optimizer(model);
  EXPECT_TRUE(optimizer.optimize(problem, {50, 1e-12}).converged);
  ASSERT_GT(ekf.node_count(), 6);
  // The batch raises variances of steps by 1e-8: the poses then are known to 1e-4 sqrt(40) m.
  for (int node = 0; node < ekf.node_count(); ++node) {
    for (int i = 0; i < M; ++i) {
      EXPECT_NEAR(problem.nodes[node][i], ekf.node_values(node)[i], 2e-4);
    }
    std::vector<int> wanted(M);
    for (int i = 0; i < M; ++i) wanted[i] = BatchOptimizer<M>::node_variable(problem, node) + i;
    const Eigen::MatrixXd exact = ekf.node_covariance({node});
    EXPECT_LT((optimizer.covariance(problem, wanted) - exact).norm(), 1e-3 * exact.norm());
  }
  EXPECT_LT((problem.offset - ekf.robot().tail<2>()).norm(), 2e-4);
}

TEST(BlockPattern, HoldsTheLowerTriangle) {
  std::vector<std::pair<int, int>> pairs = {{2, 0}, {1, 2}, {0, 2}};
  BlockPattern pattern;
  pattern.build({2, 1, 3}, pairs);
  Eigen::MatrixXd values(3, 2);
  values << 1, 2, 3, 4, 5, 6;
  pattern.matrix().coeffs().setZero();
  pattern.add(pattern.find(2, 0), 2, 0, values, 0, 0);
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(6, 6);
  expected.block(3, 0, 3, 2) = values;
  EXPECT_EQ(Eigen::MatrixXd(pattern.matrix()), expected);
  const Eigen::MatrixXd square = Eigen::MatrixXd::Constant(3, 3, 7.0);
  pattern.add(pattern.find(2, 2), 2, 2, square, 0, 0);
  EXPECT_EQ(pattern.matrix().coeff(4, 3), 7.0);
  EXPECT_EQ(pattern.matrix().coeff(3, 4), 0.0);  // the lower triangle only
  EXPECT_EQ(pattern.matrix().nonZeros(), 3 + 1 + 6 + 6 + 3);
}

}  // namespace
