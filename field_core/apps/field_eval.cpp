// field_eval: how far an estimated trajectory is from the truth.
#include <CLI/CLI.hpp>
#include <iostream>
#include <map>
#include <stdexcept>

#include "evaluation.hpp"
#include "field_core/csv.hpp"
#include "field_core/errors.hpp"
#include "plot.hpp"
#include "report.hpp"
#include "trajectory_source.hpp"

namespace {

constexpr const char* kDescription =
    "Compares an estimated trajectory, and baselines, with the truth.\n"
    "Trajectories: x.tum, x.csv (stamp_s,x_m,y_m,yaw_rad[,cov_xx,...]) or x.bag:/topic.";
constexpr const char* kBaselineHelp =
    "a trajectory to compare with, as is; NAME=odom:FILE: odometry, dead reckoning from the true "
    "start; NAME=scaled:FILE: the same with the best constant translation scale";

struct Arguments {
  field_eval::Options options;
  field_eval::PlotOptions plot;
  std::vector<std::string> baselines;
  std::string json;
};

void declare(CLI::App& app, Arguments& a) {
  using field_core::Alignment;
  static const std::map<std::string, Alignment> alignments = {
      {"none", Alignment::none}, {"first", Alignment::first}, {"best", Alignment::best}};
  const CLI::Validator source(field_eval::problem_of_source, "TRAJECTORY");
  const CLI::Validator baseline(
      [](const std::string& text) -> std::string {
        try {
          field_eval::parse_baseline(text);
        } catch (const std::invalid_argument& error) {
          return error.what();
        }
        return {};
      },
      "NAME=[odom:|scaled:]TRAJECTORY");
  const CLI::Validator picture(
      [](const std::string& path) -> std::string {
        for (const char* end : {".png", ".pdf", ".svg"}) {
          if (path.size() > 4 && path.substr(path.size() - 4) == end) return {};
        }
        return "'" + path + "' is no .png, .pdf or .svg file";
      },
      "FILE");
  app.add_option("--truth", a.options.truth, "the true trajectory")->required()->check(source);
  app.add_option("--estimate", a.options.estimate, "the estimated one")->required()->check(source);
  app.add_option("--baseline", a.baselines, kBaselineHelp)
      ->check(baseline)
      ->allow_extra_args(false);
  app.add_option("--align", a.options.alignment, "lay the estimate over the truth before comparing")
      ->transform(CLI::Transformer(alignments, CLI::ignore_case).description("none|first|best"))
      ->default_str("none");
  app.add_option("--relative-distance", a.options.relative_distance,
                 "path length of the relative errors [m]; default a tenth of the path")
      ->check(CLI::PositiveNumber);
  app.add_option("--json", a.json, "write the numbers to this file");
  auto* plot = app.add_option("--plot", a.plot.output, "draw paths and errors")->check(picture);
  app.add_option("--map", a.plot.map, "field_<name>.csv of a replay, drawn under the paths")
      ->needs(plot);
  app.add_option("--map-unit", a.plot.map_unit, "unit of that field")->needs(plot);
  app.add_option("--title", a.plot.title, "title of the picture")->needs(plot);
}

void work(Arguments& a) {
  for (const auto& text : a.baselines) {
    a.options.baselines.push_back(field_eval::parse_baseline(text));
  }
  const auto evaluation = field_eval::evaluate(a.options);
  if (!a.plot.output.empty()) field_eval::plot(evaluation, a.plot);
  if (!a.json.empty()) field_core::write_file_atomically(a.json, field_eval::json(evaluation));
  std::cout << field_eval::table(evaluation) << std::flush;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(kDescription, "field_eval");
  Arguments arguments;
  declare(app, arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help
    std::cerr << "field_eval: " << error.what() << " (see field_eval --help)\n";
    return 2;
  }
  try {
    work(arguments);
  } catch (const std::exception& error) {
    std::cerr << "field_eval: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
