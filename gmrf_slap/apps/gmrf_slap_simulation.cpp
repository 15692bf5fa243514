// The paper's section III over several seeds, one CSV line per seed and case.
//   gmrf_slap_simulation [key=value ...]
// Keys: seeds, first_seed, side, steps, robots, particles, lag, known_start, sigma_e, score_every,
// prune_mass, merge_loss, belief=trajectories|lattice|gaussian, engine=dense|sparse|local,
// cases=123, field=FILE (a CSV with a column `value`, one row per site: a real field on a bounded
// grid), dump=PREFIX (writes PREFIX<case>_field.csv and PREFIX<case>_path.csv of the first seed)
#include <cstdio>
#include <iostream>
#include <map>
#include <string>

#include "field_core/csv.hpp"
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

Engine engine_of(const std::string& name) {
  if (name == "dense") return Engine::dense;
  if (name == "sparse") return Engine::sparse;
  if (name == "local") return Engine::local;
  throw field_core::DataError("engine=" + name + " is not one of dense, sparse, local");
}

Eigen::VectorXd field_of(const std::string& path, int side) {
  const auto table = field_core::CsvTable::read(path);
  const std::size_t column = table.column("value");
  if (table.rows() != static_cast<std::size_t>(side) * static_cast<std::size_t>(side)) {
    throw field_core::DataError(path + ": has " + std::to_string(table.rows()) +
                                " rows, one per site is needed; set side");
  }
  Eigen::VectorXd field(static_cast<Eigen::Index>(table.rows()));
  for (std::size_t r = 0; r < table.rows(); ++r) {
    field[static_cast<Eigen::Index>(r)] = table.number(r, column);
  }
  return field;
}

std::string line(std::initializer_list<double> values) {
  std::string text;
  for (const double v : values) text += (text.empty() ? "" : ",") + field_core::format_number(v);
  return text + "\n";
}

void write(const SimulationRecord& record, const std::string& prefix) {
  std::string field = "x_m,y_m,truth,mean,variance\n";
  for (Eigen::Index s = 0; s < record.truth.size(); ++s) {
    field += line({record.sites(0, s), record.sites(1, s), record.truth[s], record.mean[s],
                   record.variance[s]});
  }
  field_core::write_file_atomically(prefix + "_field.csv", field);
  std::string path =
      "step,robot,true_x_m,true_y_m,observed_x_m,observed_y_m,estimated_x_m,estimated_y_m,"
      "cov_xx,cov_xy,cov_yy\n";
  for (const SimulationRecord::Visit& v : record.visits) {
    path += line({static_cast<double>(v.step), static_cast<double>(v.robot), v.truth.x(),
                  v.truth.y(), v.observed.x(), v.observed.y(), v.estimate.x(), v.estimate.y(),
                  v.covariance(0, 0), v.covariance(0, 1), v.covariance(1, 1)});
  }
  field_core::write_file_atomically(prefix + "_path.csv", path);
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
  if (options.count("prune_mass")) base.prune_mass = std::stod(options.at("prune_mass"));
  if (options.count("merge_loss")) base.merge_loss = std::stod(options.at("merge_loss"));
  settings.score_every = number(options, "score_every", 1);
  if (options.count("field")) {
    settings.field = field_of(options.at("field"), settings.side);
    settings.wrap = false;
  }
  if (options.count("engine")) base.engine = engine_of(options.at("engine"));
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
      SimulationRecord record;
      const bool dump = s == first && options.count("dump") > 0;
      print(seed, c - '0',
            simulate(settings, params, static_cast<Knowledge>(c - '1'), seed,
                     dump ? &record : nullptr));
      if (dump) write(record, options.at("dump") + c);
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
