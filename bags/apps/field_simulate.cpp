// A simulated robot in a simulated field: see README.md for worlds.
#include <iostream>

#include "field_bags/bag_writer.hpp"
#include "field_bags/program.hpp"
#include "field_bags/simulate.hpp"
#include "field_core/csv.hpp"
#include "field_ros/param_doc.hpp"

int main(int argc, char** argv) {
  CLI::App app(
      "Simulates a robot that drives through the fields of a world file and writes a bag with\n"
      "/odom, /tf, /field and /ground_truth (of several robots, each below its name). The same "
      "world and seed give the same bytes.",
      "field_simulate");
  std::string world, output, survey;
  std::uint64_t seed = 0;
  double spacing = 1.0;
  app.add_option("--world", world, "world file (YAML)")->required();
  app.add_option("--seed", seed, "of all randomness")->required();
  app.add_option("--output", output, "bag to write; replaced if it exists")->required();
  app.add_option("--survey", survey, "also write a survey of the fields on a grid (CSV)");
  app.add_option("--survey-spacing", spacing, "of that grid [m]")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.add_flag_callback(
      "--world-keys",
      []() {
        std::cout << field_ros::commented_yaml(
            field_ros::document_params<field_bags::WorldParams>());
        throw CLI::Success();
      },
      "print every key of a world file with its default, unit and range");
  return field_bags::run_program(app, argc, argv, [&]() {
    const field_bags::WorldParams params = field_bags::load_world(world);
    const std::vector<field_bags::Recording> robots = field_bags::simulate_all(params, seed);
    if (!survey.empty()) {
      const std::string csv = field_bags::simulate_survey(params, seed, spacing);
      field_core::write_file_atomically(survey, csv);
    }
    field_bags::write_bag(robots, output);
    for (const field_bags::Recording& r : robots) {
      std::cout << output << ": " << (r.robot.empty() ? "" : r.robot + ": ") << r.odometry.size()
                << " odometry poses, " << r.measurements.size() << " measurements of "
                << r.fields.size() << (r.fields.size() == 1 ? " field\n" : " fields\n");
    }
  });
}
