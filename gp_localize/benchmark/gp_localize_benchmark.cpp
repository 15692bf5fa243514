// Cost of a filter step: how it grows with particles, paths, support points and fields, and that it
// does not grow with the length of the run. Repeat: rosrun gp_localize gp_localize_benchmark
#include <benchmark/benchmark.h>
#include <malloc.h>

#include <chrono>
#include <cmath>
#include <ctime>
#include <string>

#include "field_core/random.hpp"
#include "gp_localize/gp_localize.hpp"

namespace {

using gp_localize::GpLocalize;

gp_localize::GpLocalizeParams params(int particles, int paths, int support, int fields) {
  gp_localize::GpLocalizeParams p;
  for (int f = 0; f < fields; ++f) {
    gp_localize::FieldParams field;
    field.mean = -60.0;
    field.signal_stddev = 8.0 + f;
    field.noise_stddev = 2.0;
    field.length_scales = {3.0 + 0.3 * f, 4.0 - 0.2 * f};  // each field its own: nothing is shared
    p.fields["ap" + std::to_string(f)] = field;
  }
  p.map_hypotheses = gp_localize::MapHypotheses::sample_paths;
  p.particles = particles;
  p.sample_paths = paths;
  p.support.region = {0.0, 0.0, 20.0, 16.0};
  p.support.size = support;
  p.odometry_noise = {0.02, 0.01, 0.02, 0.01};
  p.initial_pose_x = p.initial_pose_y = 8.0;
  p.initial_cov_xx = p.initial_cov_yy = 0.01;
  p.initial_cov_aa = 0.001;
  return p;
}

/// A robot driving circles through fields that are sums of sines.
class Drive {
 public:
  explicit Drive(int fields) : fields_(fields), random_(5) {}
  void step(GpLocalize& filter) {
    const auto from = std::chrono::seconds(time_), to = std::chrono::seconds(++time_);
    const field_core::SE2 delta(0.4, 0.0, 0.1);
    pose_ = pose_ * delta;
    filter.predict({from, to, delta});
    field_core::Sample sample{to, {}, {}};
    for (int f = 0; f < fields_; ++f) {
      const double value = -60.0 + 8.0 * std::sin(0.4 * pose_.x() + f) * std::cos(0.3 * pose_.y());
      sample.readings.push_back({f, value + 2.0 * random_.normal(), 0.0});
    }
    benchmark::DoNotOptimize(filter.update(sample));
  }

 private:
  int fields_;
  field_core::Random random_;
  field_core::SE2 pose_{8.0, 8.0, 0.0};
  long time_ = 0;
};

/// particles, paths, support points, fields, 0 single or 1 double precision
void step(benchmark::State& state) {
  auto p = params(state.range(0), state.range(1), state.range(2), state.range(3));
  p.precision = state.range(4) ? gp_localize::Precision::double_precision
                               : gp_localize::Precision::single_precision;
  GpLocalize filter(p, 1);
  Drive drive(state.range(3));
  for (int i = 0; i < 20; ++i) drive.step(filter);
  for (auto _ : state) drive.step(filter);
}
BENCHMARK(step)
    ->ArgNames({"particles", "paths", "support", "fields", "double"})
    ->Args({400, 400, 40, 1, 0})
    ->Args({400, 400, 40, 1, 1})
    ->Args({400, 400, 40, 6, 0})
    ->Args({400, 400, 40, 6, 1})
    ->Args({800, 400, 40, 1, 0})
    ->Args({400, 800, 40, 1, 0})
    ->Args({400, 400, 80, 1, 0})
    ->Unit(benchmark::kMillisecond)
    ->MinTime(1.0);

/// A map per particle: particles, support points, fields
void particle_map_step(benchmark::State& state) {
  auto p = params(state.range(0), 1, state.range(1), state.range(2));
  p.map_hypotheses = gp_localize::MapHypotheses::particle;
  GpLocalize filter(p, 1);
  Drive drive(state.range(2));
  for (int i = 0; i < 20; ++i) drive.step(filter);
  for (auto _ : state) drive.step(filter);
}
BENCHMARK(particle_map_step)
    ->ArgNames({"particles", "support", "fields"})
    ->Args({400, 40, 1})
    ->Args({400, 40, 6})
    ->Args({5000, 40, 6})
    ->Args({400, 120, 1})
    ->Unit(benchmark::kMillisecond);

/// The same step after 0, 1000, 10000 steps: the times should agree.
void step_after(benchmark::State& state) {
  GpLocalize filter(params(200, 200, 40, 1), 1);
  Drive drive(1);
  for (int i = 0; i < state.range(0); ++i) drive.step(filter);
  for (auto _ : state) drive.step(filter);
}
BENCHMARK(step_after)
    ->ArgName("steps")
    ->Arg(0)
    ->Arg(1000)
    ->Arg(10000)
    ->Unit(benchmark::kMillisecond);

/// 20,000 steps: mean processor time per step of the last tenth over that of the second tenth, and
/// the memory that came into use between them. 0 sample paths, 1 map per particle
void long_run(benchmark::State& state) {
  constexpr int kSteps = 20000, kTenth = kSteps / 10;
  auto p = params(100, 100, 40, 2);
  if (state.range(0) == 1) p.map_hypotheses = gp_localize::MapHypotheses::particle;
  for (auto _ : state) {
    GpLocalize filter(p, 1);
    Drive drive(2);
    double second_tenth = 0.0, last_tenth = 0.0;
    std::size_t before = 0;
    for (int i = 0; i < kSteps; ++i) {
      if (i == 2 * kTenth) before = mallinfo2().uordblks;
      const std::clock_t start = std::clock();
      drive.step(filter);
      const double taken = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
      if (i / kTenth == 1) second_tenth += taken;
      if (i / kTenth == 9) last_tenth += taken;
    }
    state.counters["time_ratio"] = last_tenth / second_tenth;
    state.counters["memory_growth_bytes"] = static_cast<double>(mallinfo2().uordblks - before);
  }
}
BENCHMARK(long_run)
    ->ArgName("particle_maps")
    ->Arg(0)
    ->Arg(1)
    ->Iterations(1)
    ->Unit(benchmark::kSecond);

}  // namespace

BENCHMARK_MAIN();
