// Hyperparameters of every field by maximum likelihood, as `fields:` of a configuration.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <sstream>

#include "bag_survey.hpp"
#include "field_core/csv.hpp"
#include "field_core/errors.hpp"
#include "field_ros/program.hpp"
#include "gp_localize/hyperparameter_learning.hpp"

namespace {

using field_core::KernelType;

const std::map<std::string, std::vector<KernelType>> kKernels = {
    {"squared_exponential", {KernelType::squared_exponential}},
    {"matern32", {KernelType::matern32}},
    {"matern52", {KernelType::matern52}},
    {"best", {KernelType::squared_exponential, KernelType::matern52, KernelType::matern32}}};

struct Options {
  std::string survey, output, kernel = "squared_exponential";
  BagSurveyOptions bag;
  std::map<std::string, std::string> units;
  std::vector<std::string> coregionalize;  // NAME=FIELD,FIELD,..
  gp_localize::LearningOptions learning;
};

gp_localize::LearningProgress progress_of(const std::string& field) {
  if (::isatty(STDERR_FILENO) != 1) return {};
  return [field](int start, int starts, double best) {
    std::cerr << "\r\033[K" << field << ": start " << start << " of " << starts;
    if (start > 1) std::cerr << ", log likelihood " << best;
    std::cerr << std::flush;
  };
}

/// "room=light,heat": the group's name and its fields.
std::pair<std::string, std::vector<std::string>> parse_group(const std::string& text) {
  const std::size_t equals = text.find('=');
  std::vector<std::string> fields;
  std::istringstream list(equals == std::string::npos ? "" : text.substr(equals + 1));
  for (std::string field; std::getline(list, field, ',');) fields.push_back(field);
  std::vector<std::string> sorted = fields;
  std::sort(sorted.begin(), sorted.end());
  const bool twice = std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end();
  if (equals == 0 || fields.size() < 2 || fields.size() > 12 || twice) {
    throw CLI::ValidationError("--coregionalize",
                               "'" + text + "' is not NAME=FIELD,FIELD,.. of 2 to 12 fields");
  }
  return {text.substr(0, equals), fields};
}

/// Learns the groups; their fields leave the survey.
void learn_groups(const Options& options, const std::string& source, gp_localize::Survey& survey,
                  std::string& fields, std::string& groups) {
  for (const std::string& text : options.coregionalize) {
    const auto [name, names] = parse_group(text);
    try {
      const auto group =
          gp_localize::learn_group(survey, names, options.learning, progress_of(name));
      for (std::size_t f = 0; f < names.size(); ++f) {
        const auto unit = options.units.find(names[f]);
        fields += gp_localize::to_yaml(names[f], unit == options.units.end() ? "1" : unit->second,
                                       group.fields[f]);
        survey.erase(names[f]);
      }
      groups += gp_localize::to_yaml(name, group);
    } catch (const field_core::DataError& e) {
      throw field_core::DataError(source + ": group '" + name + "': " + e.what());
    } catch (const field_core::NumericalError& e) {
      throw field_core::NumericalError(source + ": group '" + name + "': " + e.what());
    }
    if (::isatty(STDERR_FILENO) == 1) std::cerr << "\r\033[K" << std::flush;
  }
}

int learn(const Options& options) {
  const std::string source = options.survey.empty() ? options.bag.bag : options.survey;
  gp_localize::Survey survey = options.survey.empty()
                                   ? read_bag_survey(options.bag)
                                   : gp_localize::read_survey(source, options.bag.fields);
  std::string text = "# Maximum likelihood over " + source.substr(source.rfind('/') + 1) +
                     ", by learn_hyperparameters; +- one standard error.\nfields:\n";
  std::string groups;
  learn_groups(options, source, survey, text, groups);
  for (const auto& [name, field] : survey) {
    try {
      const auto unit = options.units.find(name);
      text += gp_localize::to_yaml(
          name, unit == options.units.end() ? "1" : unit->second,
          gp_localize::learn_hyperparameters(field, options.learning, progress_of(name)));
    } catch (const field_core::DataError& e) {
      throw field_core::DataError(source + ": field '" + name + "' " + e.what());
    } catch (const field_core::NumericalError& e) {
      throw field_core::NumericalError(source + ": field '" + name + "': " + e.what());
    }
    if (::isatty(STDERR_FILENO) == 1) std::cerr << "\r\033[K" << std::flush;
  }
  if (!groups.empty()) text += "coregionalization:\n" + groups;
  field_core::write_file_atomically(options.output, text);
  return field_ros::kExitOk;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Learns mean, signal, noise and length scales of every field by maximum likelihood from "
      "measurements at known places, and writes them as `fields:` of a configuration.");
  Options o;
  auto* survey = app.add_option("--survey", o.survey, "CSV with x_m, y_m and one column per field");
  app.add_option("--bag", o.bag.bag, "bag with measurements and the true poses")->excludes(survey);
  app.add_option("--output", o.output, "YAML to write")->required();
  app.add_option("--fields", o.bag.fields, "only these fields")->delimiter(',');
  app.add_option("--truth-topic", o.bag.truth_topic, "true poses")->capture_default_str();
  app.add_option("--field-topic", o.bag.field_topic, "measurements")->capture_default_str();
  app.add_option("--base-frame", o.bag.base_frame, "frame of the poses")->capture_default_str();
  app.add_option("--unit", o.units, "unit of a field: NAME UNIT; may be repeated");
  app.add_option(
      "--coregionalize", o.coregionalize,
      "fields that are correlated, learned together: NAME=FIELD,FIELD,..; may be repeated");
  app.add_option("--kernel", o.kernel, "covariance function; best: the most likely of the three")
      ->check(CLI::IsMember({"squared_exponential", "matern32", "matern52", "best"}))
      ->capture_default_str();
  app.add_option("--starts", o.learning.starts, "starts of the search per kernel")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--seed", o.learning.seed, "of the starts")->capture_default_str();
  app.add_option("--exact-up-to", o.learning.exact_up_to,
                 "measurements up to which the likelihood is exact; above: PITC")
      ->check(CLI::Range(0, 5000))
      ->capture_default_str();
  app.add_option("--support", o.learning.support, "support points of PITC")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--slice-size", o.learning.slice_size, "consecutive measurements of a PITC slice")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  try {
    app.parse(argc, argv);
    if (o.survey.empty() && o.bag.bag.empty()) throw CLI::RequiredError("--survey or --bag");
    for (const std::string& group : o.coregionalize) parse_group(group);
    o.learning.kernels = kKernels.at(o.kernel);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? field_ros::kExitOk : field_ros::kExitBadArguments;
  }
  return field_ros::run_guarded([&o] { return learn(o); });
}
