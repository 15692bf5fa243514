// Cost of one step: motion, measurement and mean recovery, within a cell and at a cell change, in
// maps of any size and after any number of steps; the EKF beside it.
#include <benchmark/benchmark.h>

#include <cmath>

#include "vector_field_slam/ekf_solver.hpp"
#include "vector_field_slam/eseif_solver.hpp"

using namespace vector_field_slam;

namespace {

constexpr int M = 4;

VectorFieldSlamParams beacon_params() {
  VectorFieldSlamParams p;
  p.sensor_model = SensorModelType::beacon_pairs;
  for (const char* name : {"a_x", "a_y", "b_x", "b_y"}) p.channels[name].noise_stddev = 0.05;
  return p;
}

/// A robot that is told where it goes, over a field that bends a little.
struct Driver {
  Model<M> model{beacon_params(), make_channels(beacon_params())};
  std::unique_ptr<Solver> solver;
  double x = 0.0, y = 0.0, yaw = 0.0;

  explicit Driver(std::unique_ptr<Solver> s) : solver(std::move(s)) {
    StartState start;
    start.robot.setZero();
    start.covariance = 1e-4 * RobotMatrix::Identity();
    start.node_values = Eigen::MatrixXd::Zero(M, 4);
    solver->start(start);
  }
  void step(double to_x, double to_y) {
    const double turn = 0.1;
    OdometryStep<double> s{to_x - x, to_y - y, turn, {}};
    s.noise[0][0] = s.noise[1][1] = 1e-5;
    s.noise[2][2] = 1e-5;
    x = to_x;
    y = to_y;
    yaw += turn;
    const double c = std::cos(yaw), si = std::sin(yaw);
    const double f[M] = {-0.4 * x, -0.4 * y + 0.02 * std::sin(x), 1.0 - 0.4 * x,
                         0.5 - 0.4 * y + 0.02 * std::cos(y)};
    Observation<double> z[M];
    for (int i = 0; i < M; i += 2) {
      z[i] = {i, c * f[i] + si * f[i + 1], 0.0025};
      z[i + 1] = {i + 1, -si * f[i] + c * f[i + 1], 0.0025};
    }
    solver->move(s, 0.0);
    benchmark::DoNotOptimize(solver->observe({}, z, M));
  }
  /// Back and forth over a block of side x side cells, four measurements in each.
  void explore(int side) {
    for (int row = 0; row < side; ++row) {
      for (int i = 0; i < 4 * side; ++i) {
        step(0.25 * (row % 2 == 0 ? i : 4 * side - 1 - i) - 0.375, row + 0.1 * (i % 4));
      }
    }
  }
};

/// The defaults of a node, but for what is said.
std::unique_ptr<Solver> eseif(int rings = 1, double underweighting = 0.0) {
  EseifOptions options;
  options.rings = rings;
  options.underweighting = underweighting;
  return std::make_unique<EseifSolver<M>>(Model<M>(beacon_params(), make_channels(beacon_params())),
                                          options);
}
std::unique_ptr<Solver> ekf() {
  return std::make_unique<EkfSolver<M>>(Model<M>(beacon_params(), make_channels(beacon_params())),
                                        0.0, 1 << 20);
}

/// Small moves within the cell where the exploration of a block of cells ended.
void within_a_cell(benchmark::State& state, std::unique_ptr<Solver> solver) {
  Driver driver(std::move(solver));
  driver.explore(static_cast<int>(state.range(0)));
  const double x = driver.x, y = driver.y;
  double t = 0.0;
  for (auto _ : state) {
    t += 0.3;
    driver.step(x + 0.2 * std::cos(t), y + 0.2 * std::sin(t));
  }
  state.counters["nodes"] = driver.solver->node_count();
}
void EseifStep(benchmark::State& state) { within_a_cell(state, eseif()); }
void EseifStepUnderweighted(benchmark::State& state) { within_a_cell(state, eseif(1, 4.0)); }
void EkfStep(benchmark::State& state) { within_a_cell(state, ekf()); }

/// To and fro over an edge between known cells in the middle of the block.
void EseifKnownCellChange(benchmark::State& state) {
  const int side = static_cast<int>(state.range(0));
  Driver driver(eseif(static_cast<int>(state.range(1))));
  driver.explore(side);
  bool right = false;
  for (auto _ : state) {
    right = !right;
    driver.step(side / 2 + (right ? 1 : 0), side / 2);
  }
}

/// A new cell in every step, along a spiral of lanes: one to three new nodes each.
void EseifNewCell(benchmark::State& state) {
  const int side = 100;
  Driver driver(eseif(static_cast<int>(state.range(0))));
  int cell = 0;
  for (auto _ : state) {
    const int row = cell / side, i = cell % side;
    if (row == side) {
      state.PauseTiming();
      driver = Driver(eseif(static_cast<int>(state.range(0))));
      cell = 0;
      state.ResumeTiming();
      continue;
    }
    driver.step(row % 2 == 0 ? i : side - 1 - i, row);
    ++cell;
  }
}

/// The last of a million steps cost what the first do.
void EseifAfterAMillionSteps(benchmark::State& state) {
  static Driver driver = [] {
    Driver d(eseif());
    d.explore(20);
    for (int i = 0; i < 1000000; ++i) {
      d.step(10.0 + 0.3 * std::cos(0.3 * i), 10.0 + 0.3 * std::sin(0.3 * i));
    }
    return d;
  }();
  double t = 0.0;
  for (auto _ : state) {
    t += 0.3;
    driver.step(10.0 + 0.3 * std::cos(t), 10.0 + 0.3 * std::sin(t));
  }
}

BENCHMARK(EseifStep)->Arg(1)->Arg(6)->Arg(20)->Arg(100);
BENCHMARK(EseifStepUnderweighted)->Arg(20);
BENCHMARK(EseifKnownCellChange)->Args({20, 0})->Args({20, 1})->Args({20, 2})->Args({100, 1});
BENCHMARK(EseifNewCell)->Arg(0)->Arg(1);
BENCHMARK(EseifAfterAMillionSteps);
BENCHMARK(EkfStep)->Arg(1)->Arg(6)->Arg(12)->Arg(20);

}  // namespace

BENCHMARK_MAIN();
