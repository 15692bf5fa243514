// NEES of the pose in worlds that match the model (test/consistency_world.hpp), over seeds: the
// tables of docs/results/gp_localize.md.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>

#include "consistency_world.hpp"

namespace {

struct Sums {
  double nees = 0.0, squared_error = 0.0, variance = 0.0, paths_left = 0.0;
  void add(const gp_localize::ConsistencyDrive& drive) {
    nees += drive.nees();
    squared_error += drive.error().head<2>().squaredNorm();
    variance += drive.filter().belief().covariance.topLeftCorner<2, 2>().trace();
    paths_left += drive.filter().health().paths_left;
  }
};

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "NEES of the pose (3 is ideal) in a world that is as the model says, while mapping or on a "
      "known map; a lap is 12.6 m. Position error and deviation are root mean squares over the "
      "seeds.");
  gp_localize::GpLocalizeParams params = gp_localize::consistency_params();
  gp_localize::ConsistencySurvey survey;
  double distance = 0.3;
  bool independent = false, lifelong = false;
  int steps = 120, every = 20, seeds = 50, first = 1;
  app.add_option("--particles", params.particles)
      ->capture_default_str()
      ->check(CLI::Range(1, 100000));
  app.add_option("--support", params.support.size)
      ->capture_default_str()
      ->check(CLI::Range(1, 400));
  app.add_option("--exponent", params.likelihood_exponent, "likelihood_exponent")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 1.0));
  app.add_option("--noise-scale", params.likelihood_noise_scale, "likelihood_noise_scale")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 100.0));
  app.add_option("--paths", params.diversity.paths, "diversity/paths")
      ->capture_default_str()
      ->check(CLI::Range(0, 100000));
  app.add_option("--horizon", params.diversity.horizon, "diversity/horizon")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000000));
  app.add_option("--distance", distance, "of a step [m]")
      ->capture_default_str()
      ->check(CLI::Range(0.001, 10.0));
  const CLI::Option* known =
      app.add_option("--survey-spacing", survey.spacing,
                     "known map: from places on a grid so far apart [m]; 0.1 to 8")
          ->check(CLI::Range(0.1, 8.0));
  app.add_option("--survey-x-max", survey.x_max, "none of them further east [m]")
      ->needs("--survey-spacing");
  app.add_flag("--lifelong", lifelong, "mode: lifelong instead of localization")
      ->needs("--survey-spacing");
  app.add_flag("--independent", independent, "map_error_correlation: false");
  app.add_option("--steps", steps)->capture_default_str()->check(CLI::Range(1, 100000));
  app.add_option("--every", every, "steps between rows")
      ->capture_default_str()
      ->check(CLI::Range(1, 100000));
  app.add_option("--seeds", seeds)->capture_default_str()->check(CLI::Range(1, 100000));
  app.add_option("--first-seed", first)->capture_default_str();
  CLI11_PARSE(app, argc, argv);

  params.map_error_correlation = !independent;
  if (lifelong) survey.mode = gp_localize::Mode::lifelong;
  if (*known) {
    survey.file = std::filesystem::temp_directory_path() /
                  ("gp_localize_consistency_" + std::to_string(::getpid()) + ".csv");
  }
  std::vector<Sums> rows(steps / every);
  for (int seed = first; seed < first + seeds; ++seed) {
    gp_localize::ConsistencyDrive drive(params, seed, survey, distance);
    for (int i = 1; i <= steps; ++i) {
      drive.step();
      if (i % every == 0) rows[i / every - 1].add(drive);
    }
  }
  if (*known) std::filesystem::remove(survey.file);
  std::printf("step,nees,position_error_m,deviation_m,paths_left\n");
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Sums& s = rows[i];
    std::printf("%zu,%.2f,%.3f,%.3f,%.1f\n", (i + 1) * every, s.nees / seeds,
                std::sqrt(s.squared_error / seeds), std::sqrt(s.variance / seeds),
                s.paths_left / seeds);
  }
}
