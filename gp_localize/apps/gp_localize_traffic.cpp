// The paper's traffic experiment over several seeds, one CSV line per seed and method.
//   gp_localize_traffic data=FOLDER [key=value ...]
// Keys: seeds, first_seed, steps, vehicle=generated|trips, stops, drawn=1 (a field drawn from the
// model), particles (and sample paths), methods=a,b,...; describe=1 prints the graph and what is
// learned of the field instead; dump=FILE writes errors by step, dump_map=FILE the network with the
// first seed's route
#include <cstdio>
#include <iostream>
#include <map>
#include <set>
#include <sstream>
#include <string>

#include "field_core/csv.hpp"
#include "field_core/errors.hpp"
#include "traffic_study.hpp"

using namespace gp_localize;

namespace {

using Options = std::map<std::string, std::string>;

int number(const Options& options, const std::string& key, int fallback, int least) {
  const auto it = options.find(key);
  if (it == options.end()) return fallback;
  const auto value = field_core::parse_number(it->second);
  if (!value || *value < least || *value > 1e6 || *value != static_cast<int>(*value)) {
    throw field_core::DataError(key + "=" + it->second + " must be a whole number from " +
                                std::to_string(least) + " up");
  }
  return static_cast<int>(*value);
}

std::vector<std::string> methods_of(const Options& options) {
  if (!options.count("methods")) return TrafficStudy::methods();
  std::vector<std::string> names;
  std::istringstream list(options.at("methods"));
  for (std::string name; std::getline(list, name, ',');) names.push_back(name);
  return names;
}

const char* name(field_core::KernelType kernel) {
  if (kernel == field_core::KernelType::matern32) return "matern32";
  return kernel == field_core::KernelType::matern52 ? "matern52" : "squared_exponential";
}

void describe(const TrafficStudy& study) {
  const Graph& graph = study.network().graph;
  std::printf("nodes,edges,diameter\n%d,%d,%.0f\n\n", graph.nodes(), graph.arcs() / 2,
              segments(graph).maxCoeff());
  std::printf(
      "domain,kernel,log_likelihood,mean,signal_stddev,noise_stddev,left_out_training,"
      "left_out_test,length_scales\n");
  for (const bool plane : {false, true}) {
    const TrafficDomain d = study.domain(plane);
    std::printf("%s,%s,%.2f,%.2f,%.2f,%.2f,%.2f,%.2f,", d.name.c_str(), name(d.field.kernel),
                d.field.log_likelihood, d.field.value.mean, d.field.value.signal_stddev,
                d.field.value.noise_stddev, d.left_out_training, d.left_out_test);
    for (const double length : d.field.value.length_scales) std::printf("%.3g ", length);
    std::printf("\n");
  }
}

void dump_map(TrafficStudy& study, const std::string& path) {
  const TrafficNetwork& n = study.network();
  const std::vector<int> route = study.simulate(1).route;
  std::string text = "what,x1_km,y1_km,x2_km,y2_km,visits\n";
  const auto row = [&](const char* what, int a, int b, double visits) {
    text += what;
    for (const double v :
         {n.positions(0, a), n.positions(1, a), n.positions(0, b), n.positions(1, b)}) {
      text += "," + field_core::format_number(v / 1000.0);
    }
    text += "," + field_core::format_number(visits) + "\n";
  };
  for (const GraphEdge& e : n.graph.edges()) row("edge", e.from, e.to, 0);
  std::vector<int> visits(n.graph.nodes(), 0);
  for (const int node : route) ++visits[node];
  for (int node = 0; node < n.graph.nodes(); ++node) row("node", node, node, visits[node]);
  field_core::write_file_atomically(path, text);
}

int run(const Options& options) {
  TrafficSettings settings;
  const std::string vehicle = options.count("vehicle") ? options.at("vehicle") : "generated";
  if (vehicle != "generated" && vehicle != "trips") {
    throw field_core::DataError("vehicle=" + vehicle + " is not one of generated, trips");
  }
  settings.drawn = number(options, "drawn", 0, 0) != 0;
  settings.vehicle = vehicle == "trips" ? Vehicle::trips : Vehicle::generated;
  settings.driving.steps = number(options, "steps", settings.driving.steps, 2);
  settings.driving.stops = number(options, "stops", settings.driving.stops, 0);
  settings.particles = number(options, "particles", settings.particles, 1);
  settings.sample_paths = settings.particles;
  TrafficStudy study(options.at("data"), settings);
  if (options.count("dump_map")) dump_map(study, options.at("dump_map"));
  if (options.count("describe")) {
    describe(study);
    return 0;
  }
  const auto methods = methods_of(options);
  const int first = number(options, "first_seed", 1, 0), count = number(options, "seeds", 20, 1);
  std::string steps = "seed,method,step,segments\n";
  std::printf("seed,method,segments,kilometres,exact,step_s\n");
  for (int seed = first; seed < first + count; ++seed) {
    const auto vehicle = study.simulate(static_cast<std::uint64_t>(seed));
    for (const std::string& method : methods) {
      const TrafficResult r = study.localize(method, vehicle, static_cast<std::uint64_t>(seed));
      std::printf("%d,%s,%.4f,%.4f,%.4f,%.3g\n", seed, method.c_str(), r.segments, r.kilometres,
                  r.exact, r.step_seconds);
      std::fflush(stdout);
      for (std::size_t i = 0; i < r.errors.size(); ++i) {
        steps += std::to_string(seed) + "," + method + "," + std::to_string(i) + "," +
                 field_core::format_number(r.errors[i]) + "\n";
      }
    }
  }
  if (options.count("dump")) field_core::write_file_atomically(options.at("dump"), steps);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  static const std::string kUsage =
      "usage: gp_localize_traffic data=FOLDER [seeds=20] [first_seed=1] [steps=370] "
      "[particles=400]\n         [vehicle=generated|trips] [stops=0] [drawn=0] [methods=a,b,...] "
      "[describe=1]\n         [dump=FILE] [dump_map=FILE]\n";
  static const std::set<std::string> kKeys = {"data",      "seeds",    "first_seed", "steps",
                                              "particles", "vehicle",  "stops",      "drawn",
                                              "methods",   "describe", "dump",       "dump_map"};
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--help") {
      std::cout << kUsage;
      return 0;
    }
    const std::size_t equals = argument.find('=');
    if (equals == std::string::npos || kKeys.count(argument.substr(0, equals)) == 0) {
      std::cerr << "'" << argument << "' is not one of its options\n" << kUsage;
      return 2;
    }
    options[argument.substr(0, equals)] = argument.substr(equals + 1);
  }
  if (options.count("data") == 0) {
    std::cerr << kUsage;
    return 2;
  }
  try {
    return run(options);
  } catch (const std::exception& e) {
    std::cerr << "error: " << e.what() << '\n';
    return 1;
  }
}
