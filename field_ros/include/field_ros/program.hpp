// What the programs of this package share: exit codes and the one line that says what went wrong.
#pragma once

#include <functional>

namespace field_ros {

constexpr int kExitOk = 0;
constexpr int kExitBadData = 1;
constexpr int kExitBadArguments = 2;

/// Runs `body`; an exception becomes "error: ..." as one line on standard error and kExitBadData.
int run_guarded(const std::function<int()>& body);

}  // namespace field_ros
