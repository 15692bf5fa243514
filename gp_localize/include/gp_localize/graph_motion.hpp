// How something moves along a graph, learned from routes; no odometry is needed (paper section 4.3:
// the control actions of the vehicle are not known).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "field_core/random.hpp"
#include "gp_localize/graph_domain.hpp"

namespace gp_localize {

/// A step holds its node with a probability of the node, or goes on along an arc with a probability
/// of that arc and of the one it came along. State: the arc that was taken last.
///
/// Estimates from counts: hold by Laplace's rule of succession; turns after an arc back off to the
/// turns at its node (a Dirichlet prior of kBackOff observations around them), those to equal
/// chances. A plain stand-in for the hierarchical model of Yu et al. (IAT 2012).
class GraphMotion {
 public:
  static constexpr double kBackOff = 3.0;

  /// Before anything is learned: hold in half of the steps, all turns alike. `graph` must have no
  /// node without an edge.
  explicit GraphMotion(Graph graph);
  /// The nodes of a route, one per step. @throws DataError naming the step: an unknown node, or one
  /// that is no neighbour of the one before
  void learn(const std::vector<int>& route);

  const Graph& graph() const { return graph_; }
  double hold(int node) const;
  /// Given that the node is left: probability of each of graph().leaving(head(arc)).
  const Eigen::VectorXd& turns(int arc) const { return turns_[arc]; }

  /// The arc after a step.
  int move(int arc, field_core::Random& random) const;
  /// An arc that ends at `node`, all alike.
  int arrive(int node, field_core::Random& random) const;
  /// Probabilities of the arcs after a step from those before it. O(arcs degree).
  Eigen::VectorXd forward(const Eigen::VectorXd& belief) const;
  /// Per node, the sum over the arcs that end there.
  Eigen::VectorXd nodes(const Eigen::VectorXd& belief) const;

 private:
  int place_of(int arc) const;  // among the arcs that leave its tail
  void estimate_turns();

  Graph graph_;
  std::vector<Eigen::VectorXd> turn_counts_;  // per arc, over the arcs that leave its head
  std::vector<Eigen::VectorXd> turns_;        // probabilities from them
  Eigen::VectorXd held_, left_;               // per node
};

}  // namespace gp_localize
