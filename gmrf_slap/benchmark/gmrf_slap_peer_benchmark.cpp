// A map of a field from measurements at known places, mean and variance of every site after each:
// ours and MRPT's Gaussian Markov random field (CGasConcentrationGridMap2D, mrGMRF_SD) in one run.
// One thread each. Built where libmrpt-maps-dev is installed.
#include <benchmark/benchmark.h>
#include <mrpt/maps/CGasConcentrationGridMap2D.h>

#include "field_core/random.hpp"
#include "gmrf_slap/field_bank.hpp"
#include "simulation.hpp"

using namespace gmrf_slap;

namespace {

struct Reading {
  double value;
  Eigen::Vector2d place;
};

Reading draw(int side, field_core::Random& random) {
  const double edge = 0.5 * side - 1e-6;
  const double x = random.uniform(-edge, edge), y = random.uniform(-edge, edge);
  return {random.normal(0.0, 0.13), {x, y}};
}

void ours(benchmark::State& state) {
  SimulationSettings settings;
  settings.side = static_cast<int>(state.range(0));
  GmrfSlapParams params;
  params = simulation_params(settings, params);
  params.hyperparameters.resize(1);
  FieldBank fields(params);
  field_core::Random random(1);
  for (auto _ : state) {
    const Reading reading = draw(settings.side, random);
    fields.assimilate({0, reading.value, 0.01}, reading.place);
    benchmark::DoNotOptimize(fields.fields()[0].given[0]->mean().data());
    benchmark::DoNotOptimize(fields.fields()[0].given[0]->variances().data());
  }
  state.counters["sites"] = fields.lattice().sites();
}
BENCHMARK(ours)->ArgName("side")->Arg(31)->Unit(benchmark::kMillisecond);

void mrpt_gmrf(benchmark::State& state) {
  const int side = static_cast<int>(state.range(0));
  const double edge = 0.5 * side;
  using Map = mrpt::maps::CGasConcentrationGridMap2D;
  Map map(Map::mrGMRF_SD, -edge, edge, -edge, edge, 1.0f);
  map.setMinLoggingLevel(mrpt::system::LVL_ERROR);
  map.insertionOptions.GMRF_skip_variance = false;
  field_core::Random random(1);
  for (auto _ : state) {
    const Reading reading = draw(side, random);
    map.insertIndividualReading(reading.value, {reading.place.x(), reading.place.y()}, true);
    benchmark::DoNotOptimize(map.cellByIndex(0, 0));
  }
  state.counters["sites"] = static_cast<double>(map.getSizeX() * map.getSizeY());
}
BENCHMARK(mrpt_gmrf)->ArgName("side")->Arg(31)->Iterations(5)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
