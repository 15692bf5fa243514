// Not how long but how far off: the local engine against the exact sparse one, by bandwidth and
// halo.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "field_core/random.hpp"
#include "gmrf_slap/field_prior.hpp"
#include "gmrf_slap/gaussian_field.hpp"
#include "site_list.hpp"

using namespace gmrf_slap;

namespace {

constexpr int kSide = 121, kPlaces = 8, kSteps = 150;

/// Brings in a measurement of uncertain place; its predictions, before, are in mean and variance.
void condition(GaussianField& field, const std::vector<SiteRow>& rows, double z, double* mean,
               double* variance) {
  const std::vector<int> sites = sites_of(rows);
  field.focus(sites, sites);
  field.predict(rows.data(), kPlaces, mean, variance);
  MixtureUpdate update;
  update.clear(kPlaces);
  for (int k = 0; k < kPlaces; ++k) {
    update.add(rows[static_cast<std::size_t>(k)], 1.0 / kPlaces, z - mean[k], variance[k] + 0.05);
  }
  field.condition(update);
}

/// A drive in a spiral with eight meters between its turns over a field of variance 1, so that the
/// way comes by what it has seen before. Arguments: bandwidth in tenths of a site, halo in sites.
/// Errors are those of what the filter uses, predictions around the robot: of the mean in exact
/// standard deviations, of the variance relative; root mean square and worst.
void local_error(benchmark::State& state) {
  const Lattice lattice(Eigen::Vector2d::Constant(-0.5 * (kSide - 1)), 1.0, kSide, kSide, false);
  const double alpha = alpha_of_bandwidth(0.1 * static_cast<double>(state.range(0)));
  const Theta theta{kappa_of_variance(lattice, alpha, 2, 1.0), alpha, 2};
  const auto precision = prior_precision(lattice, theta);
  double mean_square = 0.0, variance_square = 0.0, mean_worst = 0.0, variance_worst = 0.0;
  for (auto _ : state) {
    WindowSettings settings;
    auto exact = make_window_field(lattice, precision, settings);
    settings.halo = static_cast<int>(state.range(1));
    auto local = make_window_field(lattice, precision, settings);
    field_core::Random random(17);
    double angle = 0.0;
    for (int t = 0; t < kSteps; ++t) {
      const double radius = 4.0 + 8.0 * angle / (2.0 * M_PI);
      angle += 2.0 / radius;
      const Eigen::Vector2d robot = radius * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      std::vector<SiteRow> rows;
      for (int k = 0; k < kPlaces; ++k) {
        const Eigen::Vector2d off(random.uniform(-1.5, 1.5), random.uniform(-1.5, 1.5));
        rows.push_back(lattice.row(robot + off, Interpolation::bilinear));
      }
      const double z = std::sin(0.1 * robot.x()) + 0.2 * random.normal();
      double mean[2][kPlaces], variance[2][kPlaces];
      condition(*exact, rows, z, mean[0], variance[0]);
      condition(*local, rows, z, mean[1], variance[1]);
      for (int k = 0; k < kPlaces; ++k) {
        const double m = std::abs(mean[1][k] - mean[0][k]) / std::sqrt(variance[0][k]);
        const double v = std::abs(variance[1][k] / variance[0][k] - 1.0);
        mean_square += m * m / (kSteps * kPlaces);
        variance_square += v * v / (kSteps * kPlaces);
        mean_worst = std::max(mean_worst, m);
        variance_worst = std::max(variance_worst, v);
      }
    }
  }
  state.counters["mean_sd"] = std::sqrt(mean_square);
  state.counters["mean_sd_worst"] = mean_worst;
  state.counters["variance_percent"] = 100.0 * std::sqrt(variance_square);
  state.counters["variance_percent_worst"] = 100.0 * variance_worst;
}
BENCHMARK(local_error)
    ->ArgNames({"bandwidth", "halo"})
    ->Args({32, 12})
    ->Args({32, 16})
    ->Args({64, 16})
    ->Args({64, 23})
    ->Args({64, 32})
    ->Args({128, 16})
    ->Args({128, 24})
    ->Args({128, 32})
    ->Args({128, 45})
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

}  // namespace
