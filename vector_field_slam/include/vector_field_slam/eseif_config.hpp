// What the embedded filter needs to know, and what it reports.
#pragma once

#include "vector_field_slam/node_extrapolation.hpp"
#include "vector_field_slam/odometry_step.hpp"

namespace vector_field_slam {

/// What becomes of the dependence between robot, map and new nodes when another cell is entered.
///   window        robot and new nodes keep their conditional on all known nodes of the new cell
///   shared_nodes  the robot keeps its conditional on the nodes that both cells share
///   blank         the paper's: robot independent of the map, eq. (41)-(42)
/// New nodes are independent of all others, eq. (14) and (44), but for `window`.
enum class Relocation : std::uint8_t { window, shared_nodes, blank };

template <class S, int M>
struct EseifConfig {
  GridGeometry<S> grid;
  SensorModel<S, M> sensor;
  ExtrapolationFactors<S, M> extrapolation;
  S prior_variance[M];          ///< of a node nobody knows anything of, > 0
  S extrapolation_variance[M];  ///< S of eq. (14), > 0
  S gate = S(0);  ///< largest squared innovation, in its variance, that is believed; 0: any
  S underweighting = S(0);  ///< factor of the second-order variance, see underweighting.hpp
  Relocation relocation = Relocation::window;
  S relocation_variance[kRobot] = {};  ///< diagonal of R0 (eq. 42), for Relocation::blank
  int rings = 1;                       ///< of nodes around the cell, recovered with it
};

enum class EseifOutcome : std::uint8_t {
  applied,
  gated,         ///< every reading was further off than the gate allows
  no_place,      ///< the sensor's place is not finite or off any grid
  map_full,      ///< the cell needs more nodes than there is room for
  not_positive,  ///< the information matrix lost definiteness: the state is not usable any more
};

template <class S>
struct EseifReport {
  EseifOutcome outcome = EseifOutcome::applied;
  int used = 0, gated = 0;  ///< readings
  S nis = S(0);             ///< normalized innovation squared of the readings used
  bool new_cell = false;
  int new_nodes = 0;
};

}  // namespace vector_field_slam
