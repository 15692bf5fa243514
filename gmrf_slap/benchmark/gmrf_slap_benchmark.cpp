// Cost of the parts of a step. One thread.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <fstream>
#include <string>

#include "field_core/random.hpp"
#include "gmrf_slap/field_prior.hpp"
#include "gmrf_slap/gaussian_field.hpp"
#include "gmrf_slap/slap.hpp"
#include "simulation.hpp"
#include "symmetric_kernels.hpp"

using namespace gmrf_slap;

namespace {

/// One moment matching at n x n sites with K candidates around the middle.
void dense_condition(benchmark::State& state) {
  const int side = static_cast<int>(state.range(0)), count = static_cast<int>(state.range(1));
  use_vector_width(static_cast<VectorWidth>(state.range(2)));
  const Lattice lattice({0.0, 0.0}, 1.0, side, side, true);
  auto field = make_dense_field(prior_precision(lattice, {50.0, 0.1, 2}));
  MixtureUpdate update;
  update.clear(count);
  for (int k = 0; k < count; ++k) {
    update.add({1, {(lattice.sites() / 3 + k) % lattice.sites()}, {1.0}}, 1.0 / count, 0.01, 1.0);
  }
  for (auto _ : state) field->condition(update);
  const double n = lattice.sites();
  state.counters["flop/s"] = benchmark::Counter(
      n * n * (count + 1), benchmark::Counter::kIsIterationInvariantRate);  // half a square product
}
BENCHMARK(dense_condition)
    ->Args({31, 300, 0})
    ->Args({31, 300, 1})
    ->Args({31, 300, 2})
    ->Args({31, 100, 2})
    ->Args({31, 30, 2})
    ->Args({31, 1, 2})
    ->Args({45, 300, 2})
    ->Unit(benchmark::kMillisecond);

/// The paper's Theta on side x side sites, sigma_e = 10.
GmrfSlapParams paper(int side, Engine engine, PositionBelief belief) {
  SimulationSettings settings;
  settings.side = side;
  GmrfSlapParams params;
  params = simulation_params(settings, params);
  params.engine = engine;
  params.position_belief = belief;
  return params;
}

/// A robot that drives straight to x = edge, back to -edge and so on, 2 m a step. Its candidates
/// are the more the less its motion is known.
class Robot {
 public:
  Robot(Slap& slap, double edge, double motion_variance = 0.25)
      : slap_(slap), edge_(edge), noise_(motion_variance * Eigen::Matrix2d::Identity()) {
    slap_.set_pose(0, field_core::SE2(0.0, 0.0, 0.0), Eigen::Vector3d(9, 9, 0).asDiagonal());
    sample_.readings = {{0, 0.0, 0.0}};
  }
  void step() {
    if (std::abs(x_ + step_) > edge_) step_ = -step_;
    x_ += step_;
    slap_.displace(0, {step_, 0.0}, noise_);
    slap_.observe_position(0, {x_ + random_.normal(0.0, 10.0), random_.normal(0.0, 10.0)});
    sample_.readings[0].value = 0.2 * std::sin(0.3 * x_) + random_.normal(0.0, 0.1);
    slap_.update(0, sample_);
  }

 private:
  Slap& slap_;
  double edge_, x_ = 0.0, step_ = 2.0;
  Eigen::Matrix2d noise_;
  field_core::Random random_{1};
  field_core::Sample sample_;
};

/// The largest resident set so far, of the whole process: run one benchmark alone to read it. [MB]
double peak_memory() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmHWM:", 0) == 0) return 1e-3 * std::stod(line.substr(6));
  }
  return 0.0;
}

double cpu_milliseconds() { return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// Steps until trajectories hold all of their lag, so that later ones cost what they always will.
constexpr int kWarmUp = 75;

/// The mean step is the benchmark's time; the worst one and what was weighed are counters.
void run_steps(benchmark::State& state, const Slap& slap, Robot& robot, int warm_up = kWarmUp) {
  for (int t = 0; t < warm_up; ++t) robot.step();
  double candidates = 0.0, left_out = 0.0, information = 0.0, worst = 0.0;
  for (auto _ : state) {
    const double begin = cpu_milliseconds();
    robot.step();
    worst = std::max(worst, cpu_milliseconds() - begin);
    candidates += static_cast<double>(slap.belief(0).particles.size());
    left_out += slap.left_out_mass(0);
    information += slap.left_out_information(0);
  }
  const auto steps = static_cast<double>(state.iterations());
  state.counters["candidates"] = candidates / steps;
  state.counters["left_out"] = left_out / steps;
  state.counters["information"] = information / steps;
  state.counters["worst_ms"] = worst;
  std::size_t bytes = 0;
  for (const auto& given : slap.bank().fields()[0].given) bytes += given->memory_bytes();
  state.counters["MB"] = 1e-6 * static_cast<double>(bytes);
  state.counters["peak_MB"] = peak_memory();
}

/// One step of one robot from wall to wall: command, position observation, measurement, L = 5.
/// Arguments: engine, belief, side.
void step(benchmark::State& state) {
  const int side = static_cast<int>(state.range(2));
  Slap slap(
      paper(side, static_cast<Engine>(state.range(0)), static_cast<PositionBelief>(state.range(1))),
      1);
  Robot robot(slap, 0.5 * side - 4.0);
  run_steps(state, slap, robot);
}
constexpr int kDense = static_cast<int>(Engine::dense), kSparse = static_cast<int>(Engine::sparse),
              kLocal = static_cast<int>(Engine::local),
              kTracks = static_cast<int>(PositionBelief::trajectories),
              kSites = static_cast<int>(PositionBelief::lattice),
              kPaper = static_cast<int>(PositionBelief::gaussian);
BENCHMARK(step)
    ->ArgNames({"engine", "belief", "side"})
    ->Args({kDense, kTracks, 31})
    ->Args({kLocal, kTracks, 31})
    ->Args({kLocal, kTracks, 101})
    ->Args({kLocal, kTracks, 301})
    ->Args({kDense, kSites, 31})
    ->Args({kDense, kPaper, 31})
    ->Args({kSparse, kSites, 101})
    ->Iterations(120)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(step)
    ->Name("step_301_sparse")
    ->ArgNames({"engine", "belief", "side"})
    ->Args({kSparse, kSites, 301})
    ->Iterations(30)
    ->Unit(benchmark::kMillisecond);

/// The same drive in the middle of grids of any size: what still depends on the grid. Arguments:
/// belief, side, where the robot turns back.
void same_drive(benchmark::State& state) {
  const auto belief = static_cast<PositionBelief>(state.range(0));
  Slap slap(paper(static_cast<int>(state.range(1)), Engine::local, belief), 1);
  Robot robot(slap, static_cast<double>(state.range(2)));
  run_steps(state, slap, robot);
}
BENCHMARK(same_drive)
    ->ArgNames({"belief", "side", "edge"})
    ->ArgsProduct({{kTracks, kSites}, {31, 51, 75, 101, 201, 301}, {4}})
    ->ArgsProduct({{kTracks, kSites}, {75, 101, 201, 301}, {20}})
    ->Iterations(120)
    ->Unit(benchmark::kMillisecond);

/// 300 candidates offered: prune_mass and merge_loss in millionths (100 and 300 by default) and the
/// vector width, 1: AVX2, 2: AVX-512.
void offered_300(benchmark::State& state) {
  GmrfSlapParams params = paper(31, Engine::dense, PositionBelief::lattice);
  params.prune_mass = 1e-6 * static_cast<double>(state.range(0));
  params.merge_loss = 1e-6 * static_cast<double>(state.range(1));
  use_vector_width(static_cast<VectorWidth>(state.range(2)));
  Slap slap(params, 1);
  Robot robot(slap, 6.0, 1.1);
  run_steps(state, slap, robot, 15);
  use_vector_width(VectorWidth::avx512);
}
BENCHMARK(offered_300)
    ->ArgNames({"prune", "merge", "width"})
    ->ArgsProduct({{100}, {0, 100, 300, 1000}, {1, 2}})
    ->ArgsProduct({{1000, 10000, 50000}, {0}, {1, 2}})
    ->Iterations(60)
    ->Unit(benchmark::kMillisecond);

/// A measurement at a known place: the map update of a mapper without localization.
void known_place(benchmark::State& state) {
  const int side = static_cast<int>(state.range(0));
  GmrfSlapParams params = paper(side, Engine::dense, PositionBelief::lattice);
  params.hyperparameters.resize(1);
  FieldBank fields(params);
  field_core::Random random(1);
  const double edge = 0.5 * side;
  for (auto _ : state) {
    fields.assimilate({0, random.normal(), 0.01},
                      {random.uniform(-edge, edge), random.uniform(-edge, edge)});
    benchmark::DoNotOptimize(fields.fields()[0].given[0]->variances().data());
  }
}
BENCHMARK(known_place)->Arg(31)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
