// Cost of the parts of a step. One thread.
#include <benchmark/benchmark.h>

#include "field_core/random.hpp"
#include "gmrf_slap/field_prior.hpp"
#include "gmrf_slap/gaussian_field.hpp"
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

}  // namespace

BENCHMARK_MAIN();
