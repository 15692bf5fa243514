// The program <package>_node: an estimator on live topics.
#pragma once

#include "field_ros/any_estimator.hpp"

namespace field_ros {

/// Checks the parameters before anything is advertised, then spins. Exit code 0; 1: bad parameters,
/// one line on standard error; 2: bad arguments.
int run_node(int argc, char** argv, const EstimatorEntry& entry, const char* name);

template <class E>
int run_node(int argc, char** argv, const char* name = E::kName) {
  return run_node(argc, argv, estimator_entry<E>(), name);
}

}  // namespace field_ros
