// Runs a program without a shell and collects what it says.
#pragma once

#include <string>
#include <vector>

namespace field_eval {

struct ProcessResult {
  int exit_code = 0;  ///< 127: the program does not exist; 128 + n: ended by signal n
  std::string output, errors;
};

/// @param arguments the program, looked up on PATH if it has no slash, and its arguments
/// @throws DataError if the system cannot start a process
ProcessResult run(const std::vector<std::string>& arguments);

/// The last line that is not blank, without ANSI colours: what a failed program meant to say.
std::string last_line(const std::string& text);

}  // namespace field_eval
