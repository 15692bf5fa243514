// The common frame of the package's programs.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace field_bags {

/// Parses the command line and runs the program.
/// @return 0; 2 if the command line is wrong; 1 after one line on stderr if `work` throws
int run_program(CLI::App& app, int argc, char** argv, const std::function<void()>& work);

}  // namespace field_bags
