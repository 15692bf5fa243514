// Cost of the parts of a step. One thread.
#include <benchmark/benchmark.h>

#include <cmath>

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

/// A robot that drives straight from wall to wall and back, 2 m a step.
class Robot {
 public:
  Robot(Slap& slap, int side) : slap_(slap), edge_(0.5 * side - 4.0) {
    slap_.set_pose(0, field_core::SE2(0.0, 0.0, 0.0), Eigen::Vector3d(9, 9, 0).asDiagonal());
    sample_.readings = {{0, 0.0, 0.0}};
  }
  void step() {
    if (std::abs(x_ + step_) > edge_) step_ = -step_;
    x_ += step_;
    slap_.displace(0, {step_, 0.0}, 0.25 * Eigen::Matrix2d::Identity());
    slap_.observe_position(0, {x_ + random_.normal(0.0, 10.0), random_.normal(0.0, 10.0)});
    sample_.readings[0].value = 0.2 * std::sin(0.3 * x_) + random_.normal(0.0, 0.1);
    slap_.update(0, sample_);
  }

 private:
  Slap& slap_;
  double edge_, x_ = 0.0, step_ = 2.0;
  field_core::Random random_{1};
  field_core::Sample sample_;
};

/// One step of one robot: command, position observation, measurement, L = 5. Arguments: engine,
/// belief, side.
void step(benchmark::State& state) {
  const int side = static_cast<int>(state.range(2));
  Slap slap(
      paper(side, static_cast<Engine>(state.range(0)), static_cast<PositionBelief>(state.range(1))),
      1);
  Robot robot(slap, side);
  for (int t = 0; t < 15; ++t) robot.step();
  std::size_t candidates = 0;
  for (auto _ : state) {
    robot.step();
    candidates += slap.belief(0).particles.size();
  }
  state.counters["candidates"] =
      static_cast<double>(candidates) / static_cast<double>(state.iterations());
  std::size_t bytes = 0;
  for (const auto& given : slap.bank().fields()[0].given) bytes += given->memory_bytes();
  state.counters["MB"] = 1e-6 * static_cast<double>(bytes);
}
constexpr int kDense = static_cast<int>(Engine::dense), kSparse = static_cast<int>(Engine::sparse),
              kLocal = static_cast<int>(Engine::local),
              kTracks = static_cast<int>(PositionBelief::trajectories),
              kSites = static_cast<int>(PositionBelief::lattice),
              kPaper = static_cast<int>(PositionBelief::gaussian);
BENCHMARK(step)
    ->ArgNames({"engine", "belief", "side"})
    ->Args({kDense, kTracks, 31})
    ->Args({kDense, kSites, 31})
    ->Args({kDense, kPaper, 31})
    ->Args({kLocal, kSites, 31})
    ->Args({kLocal, kSites, 101})
    ->Args({kLocal, kSites, 301})
    ->Args({kSparse, kSites, 101})
    ->Iterations(60)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(step)
    ->Name("step_301_sparse")
    ->ArgNames({"engine", "belief", "side"})
    ->Args({kSparse, kSites, 301})
    ->Iterations(10)
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
