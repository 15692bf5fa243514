// What the host's solvers share: reasons, texts, node lists in a state.
#pragma once

#include <cmath>
#include <vector>

#include "field_core/errors.hpp"
#include "vector_field_slam/solver.hpp"

namespace vector_field_slam {

constexpr const char* kNoPlace = "the sensor's place is off the grid";
constexpr const char* kMapFull = "the map is full: raise max_nodes";
constexpr const char* kUnknownCell = "no map at this place";
constexpr const char* kLate = "the background optimization is late: raise background_delay";
constexpr const char* kGated = "innovation outside the gate";

[[noreturn]] inline void throw_not_positive() {
  throw field_core::NumericalError(
      "the filter lost positive definiteness; the noise parameters are too far apart: raise the "
      "smallest noise_stddev or lower the largest prior_stddev, and reset");
}

inline void save_node_indices(const Solver& solver, field_core::State& state) {
  Eigen::MatrixXd indices(2, solver.node_count());
  for (int i = 0; i < solver.node_count(); ++i) {
    indices.col(i) << solver.node_index(i).x, solver.node_index(i).y;
  }
  state.set("node_indices", indices);
}

/// @throws field_core::DataError if they are no indices, or not distinct
std::vector<GridIndex> load_node_indices(const field_core::State& state);

}  // namespace vector_field_slam
