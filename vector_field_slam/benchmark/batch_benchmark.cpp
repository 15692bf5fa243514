// The batch solver: full convergence from what the information filter left, and one iteration.
#include <benchmark/benchmark.h>

#include "grid_world.hpp"
#include "vector_field_slam/batch_optimizer.hpp"

namespace {

using grid_world::World;

/// A square of n x n nodes, driven once along all rows with 1000 samples: spots as high as keeps
/// the readings in the same range, and wheels good enough that the filter covers the same square as
/// the robot.
World make_world(int side) {
  grid_world::Options options;
  options.side = side - 2.0;
  options.step = 0.42 * side / 20.0;
  options.slope = 1.6 / options.side;
  options.odometry = {1e-6, 1e-6, 5e-6, 1e-7};
  World world(options, 1);
  world.drive(1000);
  return world;
}

void batch(benchmark::State& state) {
  const World world = make_world(static_cast<int>(state.range(0)));
  vector_field_slam::BatchReport report;
  for (auto _ : state) {
    auto problem = world.log.problem();
    vector_field_slam::BatchOptimizer<World::M> optimizer(world.model);
    report = optimizer.optimize(problem);
    benchmark::DoNotOptimize(problem.poses.data());
  }
  state.counters["poses"] = static_cast<double>(world.log.problem().poses.size());
  state.counters["nodes"] = static_cast<double>(world.log.problem().nodes.size());
  state.counters["iterations"] = report.iterations;
  state.counters["cost"] = report.cost;
  state.counters["first_cost"] = report.initial_cost;
  state.counters["converged"] = report.converged;
}
BENCHMARK(batch)->Arg(6)->Arg(10)->Arg(20)->Arg(24)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
