// The paper's section III over several seeds, one CSV line per seed and case.
//   gmrf_slap_simulation [key=value ...]
// Keys: seeds, first_seed, side, steps, robots, particles, lag, known_start, sigma_e,
// belief=trajectories|lattice|gaussian, cases=123
#include <cstdio>
#include <iostream>
#include <map>
#include <string>

#include "field_core/errors.hpp"
#include "simulation.hpp"

using namespace gmrf_slap;

namespace {

using Options = std::map<std::string, std::string>;

int number(const Options& options, const std::string& key, int fallback) {
  const auto it = options.find(key);
  return it == options.end() ? fallback : std::stoi(it->second);
}

PositionBelief belief_of(const std::string& name) {
  if (name == "lattice") return PositionBelief::lattice;
  if (name == "gaussian") return PositionBelief::gaussian;
  if (name == "trajectories") return PositionBelief::trajectories;
  throw field_core::DataError("belief=" + name + " is not one of trajectories, lattice, gaussian");
}

void print(std::uint64_t seed, int which, const SimulationResult& r) {
  std::printf("%llu,%d,%.6g,%.6g,%.4f,%.4f,%.4f,%.4f,%.3g,%.3g\n",
              static_cast<unsigned long long>(seed), which, r.squared_error, r.final_squared_error,
              r.position_error, r.field_coverage, r.position_coverage, r.true_theta, r.left_out,
              r.step_seconds);
  std::fflush(stdout);
}

int run(const Options& options) {
  SimulationSettings settings;
  settings.side = number(options, "side", settings.side);
  settings.steps = number(options, "steps", settings.steps);
  settings.robots = number(options, "robots", settings.robots);
  settings.known_start = number(options, "known_start", 0) != 0;
  settings.position_stddev = number(options, "sigma_e", 10);
  GmrfSlapParams base;
  base.particles = number(options, "particles", base.particles);
  base.lag = number(options, "lag", base.lag);
  if (options.count("belief")) base.position_belief = belief_of(options.at("belief"));
  const GmrfSlapParams params = simulation_params(settings, base);
  const std::string cases = options.count("cases") ? options.at("cases") : "123";
  std::printf(
      "seed,case,squared_error,final_squared_error,position_error_m,field_coverage,"
      "position_coverage,true_theta,left_out,step_s\n");
  const int first = number(options, "first_seed", 1), count = number(options, "seeds", 5);
  for (int s = first; s < first + count; ++s) {
    const auto seed = static_cast<std::uint64_t>(s);
    for (const char c : cases) {
      print(seed, c - '0', simulate(settings, params, static_cast<Knowledge>(c - '1'), seed));
    }
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    const std::size_t equals = argument.find('=');
    if (equals == std::string::npos) {
      std::cerr << "usage: gmrf_slap_simulation [key=value ...]; '" << argument
                << "' is no key=value\n";
      return 2;
    }
    options[argument.substr(0, equals)] = argument.substr(equals + 1);
  }
  try {
    return run(options);
  } catch (const std::exception& e) {
    std::cerr << "error: " << e.what() << '\n';
    return 1;
  }
}
