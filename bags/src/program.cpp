#include "field_bags/program.hpp"

#include "field_ros/program.hpp"

namespace field_bags {

int run_program(CLI::App& app, int argc, char** argv, const std::function<void()>& work) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? field_ros::kExitOk : field_ros::kExitBadArguments;
  }
  return field_ros::run_guarded([&work]() {
    work();
    return field_ros::kExitOk;
  });
}

}  // namespace field_bags
