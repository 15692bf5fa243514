// Simulated runs through all solvers; prints one CSV row per run and solver. The worlds are those
// of the paper's figures 8 (nine runs of rising multipath) and 11 (IEC room, four corners x three
// headings); docs/results/vector_field_slam.md is made from the output.
#include <CLI/CLI.hpp>
#include <chrono>
#include <iostream>
#include <tuple>

#include "field_core/errors.hpp"
#include "simulated_run.hpp"
#include "vector_field_slam/batch_optimizer.hpp"

using namespace vector_field_slam;
using field_core::SE2;
using simulation::Step;

namespace {

struct Case {
  std::string name;
  simulation::Room setup;
};

struct Errors {
  double aligned = 0.0, unaligned = 0.0, seconds = NAN;
  /// Inside the 90 % ellipse, and NEES of (x, y): of aligned positions and of those as they are.
  double share = NAN, nees = NAN, share_unaligned = NAN, nees_unaligned = NAN;
};

double mean_distance(const std::vector<SE2>& a, const std::vector<SE2>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    sum += (a[i].translation() - b[i].translation()).norm();
  return sum / static_cast<double>(a.size());
}

/// Rising distortion: the weight of a reflection at the wall goes from 0.1 to 0.5.
std::vector<Case> nine_runs() {
  std::vector<Case> cases;
  for (int i = 0; i < 9; ++i) {
    Case c{"run" + std::to_string(i + 1), {}};
    c.setup.heading_noise = 0.021;  // odometry then errs by the paper's 26 cm
    c.setup.rotation_noise = 0.021;
    c.setup.multipath = 0.1 + 0.05 * i;
    cases.push_back(c);
  }
  return cases;
}

/// The paper's figure 11: 21 minutes in 5 x 4 m at two samples a second, around furniture, from
/// four corners with three headings each.
std::vector<Case> iec_room() {
  std::vector<Case> cases;
  for (int i = 0; i < 12; ++i) {
    Case c{"room" + std::to_string(i + 1), {}};
    c.setup.half_x = 2.5;
    c.setup.half_y = 2.0;
    c.setup.steps = 2520;
    c.setup.obstacles = {{-0.3, 0.5, 0.5, 1.3}, {0.6, -1.2, 1.3, -0.6}};
    const double x = i % 2 == 0 ? -2.0 : 2.0, y = i / 2 % 2 == 0 ? -1.5 : 1.5;
    c.setup.start = SE2(x, y, 2.0 * M_PI / 3.0 * (i / 4));
    cases.push_back(c);
  }
  return cases;
}

/// Square halls of 6, 10 and 16 m, spots half as high as a hall is wide, better wheels: the larger,
/// the longer the robot drives where it has not been.
std::vector<Case> halls() {
  std::vector<Case> cases;
  for (int side : {6, 10, 16}) {
    Case c{"hall" + std::to_string(side), {}};
    c.setup.half_x = c.setup.half_y = c.setup.height = 0.5 * side;
    c.setup.steps = 1000;
    c.setup.heading_noise = c.setup.rotation_noise = c.setup.translation_noise = 0.01;
    cases.push_back(c);
  }
  return cases;
}

std::vector<Case> cases_of(const std::string& experiment) {
  if (experiment == "hall") return halls();
  return experiment == "iec" ? iec_room() : nine_runs();
}

struct Result {
  std::vector<SE2> truth, estimates;
  std::vector<Eigen::Matrix2d> covariances;

  Errors errors() const {
    const auto a = simulation::align(truth, estimates, covariances);
    Errors e;
    e.aligned = a.mean;
    e.unaligned = mean_distance(truth, estimates);
    if (!covariances.empty()) {
      e.share = a.share_inside;
      e.nees = a.nees;
      std::tie(e.share_unaligned, e.nees_unaligned) =
          simulation::consistency(truth, estimates, covariances);
    }
    return e;
  }
};

Result odometry(const std::vector<Step>& steps, const SE2& start) {
  Result r;
  SE2 pose = start;
  for (const Step& s : steps) {
    pose = pose * s.odometry;
    r.truth.push_back(s.truth);
    r.estimates.push_back(pose);
  }
  return r;
}

Result raw(const std::vector<Step>& steps, const simulation::Room& setup) {
  Result r;
  for (const Step& s : steps) {
    r.truth.push_back(s.truth);
    r.estimates.push_back(simulation::triangulate(setup, s.z));
  }
  return r;
}

/// The online estimates; with `smoothed`, also the poses of the batch over the whole run.
Result filtered(const std::vector<Step>& steps, const VectorFieldSlamParams& params,
                Result* smoothed, double& seconds) {
  VectorFieldSlam filter(params, 1);
  filter.wait_for_background();
  Result r;
  field_core::Stamp now(0);
  const auto period = std::chrono::milliseconds(500);
  const auto begin = std::chrono::steady_clock::now();
  for (const Step& s : steps) {
    filter.predict({now, now + period, s.odometry});
    now += period;
    field_core::Sample sample{now, {}, {}};
    for (int i = 0; i < 4; ++i) sample.readings.push_back({i, s.z[i], 0.0});
    filter.update(sample);
    const auto belief = filter.belief();
    r.truth.push_back(s.truth);
    r.estimates.push_back(belief.mean);
    r.covariances.push_back(belief.covariance.topLeftCorner<2, 2>());
  }
  seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (smoothed) {
    const auto trajectory = filter.state().matrix("trajectory");
    for (Eigen::Index t = 1; t < trajectory.cols(); ++t) {
      const auto sample = static_cast<std::size_t>(
          std::chrono::nanoseconds(static_cast<std::int64_t>(trajectory(0, t))) / period - 1);
      smoothed->truth.push_back(steps[sample].truth);
      smoothed->estimates.emplace_back(trajectory(1, t), trajectory(2, t), trajectory(3, t));
    }
  }
  return r;
}

void print(const std::string& run, int seed, const std::string& solver, const Errors& e) {
  std::cout << run << ',' << seed << ',' << solver << ',' << e.aligned << ',' << e.unaligned << ','
            << e.share << ',' << e.nees << ',' << e.share_unaligned << ',' << e.nees_unaligned
            << ',' << e.seconds << '\n';
}

/// The batch over the whole run, from what the filter left.
void evaluate_batch(const Case& c, int seed, const std::vector<Step>& steps,
                    VectorFieldSlamParams p) {
  p.solver = SolverType::batch;
  p.background_period = 100000;  // not before the end
  Result smoothed;
  double seconds = 0.0;
  filtered(steps, p, &smoothed, seconds);
  print(c.name, seed, "batch", smoothed.errors());
}

/// @param corrected also the online estimates that the batch corrects now and then: they take long
void evaluate(const Case& c, int seed, double interpolation_stddev, bool corrected) {
  const auto steps = simulation::simulate(c.setup, static_cast<std::uint64_t>(seed));
  print(c.name, seed, "odometry", odometry(steps, c.setup.start).errors());
  print(c.name, seed, "raw", raw(steps, c.setup).errors());
  VectorFieldSlamParams base = simulation::params(c.setup);
  const double bend = simulation::interpolation_error(c.setup, base.cell_size);
  for (auto& channel : base.channels) {
    channel.second.interpolation_stddev = interpolation_stddev > 0.0 ? interpolation_stddev : bend;
  }
  const auto online = [&](const std::string& name, const VectorFieldSlamParams& p) {
    Errors e;
    try {
      double seconds = 0.0;
      e = filtered(steps, p, nullptr, seconds).errors();
      e.seconds = seconds / static_cast<double>(steps.size());
    } catch (const field_core::NumericalError&) {
      e.aligned = e.unaligned = NAN;
    }
    print(c.name, seed, name, e);
  };
  online("eseif", base);
  VectorFieldSlamParams p = base;
  p.solver = SolverType::ekf;
  online("ekf", p);
  p = base;
  p.relocation = Relocation::shared_nodes;
  online("eseif_shared_nodes", p);
  p = base;
  p.relocation = Relocation::blank;
  p.recovery_rings = 0;
  online("eseif_paper", p);
  p = base;
  p.underweighting = 4.0;
  online("eseif_underweighted", p);
  p.solver = SolverType::ekf;
  online("ekf_underweighted", p);
  evaluate_batch(c, seed, steps, base);
  if (!corrected) return;
  p = base;
  p.background_period = 100;
  online("eseif_background", p);
  p = base;
  p.solver = SolverType::batch;
  online("eseif_corrected_at_once", p);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Simulated runs of Vector Field SLAM through all solvers; CSV on standard output.");
  std::string experiment = "nine";
  int seeds = 20, corrected_seeds = 3;
  double interpolation_stddev = 0.0;
  app.add_option("--experiment", experiment, "nine, iec or hall")
      ->check(CLI::IsMember({"nine", "iec", "hall"}))
      ->capture_default_str();
  app.add_option("--seeds", seeds, "runs of each world")->capture_default_str();
  app.add_option("--corrected-seeds", corrected_seeds,
                 "of these also the variants in which the batch corrects the online filter")
      ->capture_default_str();
  app.add_option("--interpolation-stddev", interpolation_stddev,
                 "of all channels, instead of the RMS by which the world's field differs from the "
                 "bilinear surface of its cells");
  CLI11_PARSE(app, argc, argv);
  std::cout << "run,seed,solver,aligned_m,unaligned_m,share_inside,nees_position,share_unaligned,"
               "nees_unaligned,"
               "step_s\n";
  for (int seed = 1; seed <= seeds; ++seed) {
    for (const Case& c : cases_of(experiment)) {
      const int number = std::atoi(c.name.substr(c.name.find_first_of("0123456789")).c_str());
      evaluate(c, 100 * seed + number, interpolation_stddev, seed <= corrected_seeds);
    }
  }
  return 0;
}
