// A road network with the speeds measured on it, and vehicles that drive on it: the world of the
// paper's traffic experiment (section 4.3), from the loop detectors of METR-LA.
#pragma once

#include <string>
#include <vector>

#include "field_core/random.hpp"
#include "gp_localize/graph_domain.hpp"

namespace gp_localize {

/// Every node is a detector and stands for the road around it.
struct TrafficNetwork {
  Graph graph;                   ///< connected; lengths [m]
  std::vector<int> sensors;      ///< of each node, its number in the files
  field_core::Places positions;  ///< of the nodes in the plane, 2 x nodes [m]
  std::vector<double> minutes;   ///< since the first midnight, ascending
  Eigen::MatrixXd speeds;        ///< minutes x nodes [mph]
};

/// From three files of `folder`: sensors.csv (k, x_m, y_m), edges.csv (from_k, to_k, w: similarity
/// exp(-(d / 2600 m)^2) of detectors at road distance d) and speed_mph_10min.csv (minute, k0, k1,
/// ...). Neighbours are pairs without a detour of at most 10 % over a third detector; only the
/// largest connected part is kept.
/// @throws DataError naming file, line and column
TrafficNetwork read_traffic_network(const std::string& folder);

/// Row of the speeds at a time of a day, day 0 the first. @throws DataError if there is none
int row_at(const TrafficNetwork& network, int day, double minute_of_day);

/// How a vehicle drives.
struct Driving {
  int steps = 370;
  double step_s = 60.0;
  /// 0: each trip leads to a random node; else so many random nodes of its own, in turn.
  int stops = 0;
};

/// The node of each step of a vehicle that starts at a random node. Trips lead along the quickest
/// path at the given speeds (mph, per node) under the driver's own view of each road, log-normal
/// with standard deviation 0.3, drawn anew for each trip. One step per node passed, more where that
/// takes longer than step_s.
std::vector<int> drive(const Graph& graph, const Eigen::VectorXd& speeds_mph,
                       const Driving& driving, field_core::Random& random);

}  // namespace gp_localize
