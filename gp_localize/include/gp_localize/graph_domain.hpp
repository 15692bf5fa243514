// Locations that are the nodes of a graph (road segments, rooms) instead of points of the plane:
// the paper's section 4.3. The field's kernel sees a node as a place of a few coordinates, an
// embedding of the graph beside features of the node: the relational Gaussian process of Chen et
// al. (UAI 2012), whose correlation follows both.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "field_core/kernels.hpp"

namespace gp_localize {

struct GraphEdge {
  int from, to;
  double length;  ///< [m]
};

/// Undirected, without loops and parallel edges. An arc is an edge in one of its directions: who
/// has just come along it stands at its head.
class Graph {
 public:
  /// @throws DataError naming the edge: a node that does not exist, a loop, an edge given twice, or
  ///         a length that is no positive number
  Graph(int nodes, std::vector<GraphEdge> edges);

  int nodes() const { return static_cast<int>(leaving_.size()); }
  const std::vector<GraphEdge>& edges() const { return edges_; }
  int arcs() const { return 2 * static_cast<int>(edges_.size()); }
  int tail(int arc) const { return arc % 2 ? edges_[arc / 2].to : edges_[arc / 2].from; }
  int head(int arc) const { return tail(arc ^ 1); }
  double length(int arc) const { return edges_[arc / 2].length; }
  /// Arcs whose tail is `node`, in the order of the edges.
  const std::vector<int>& leaving(int node) const { return leaving_[node]; }

 private:
  std::vector<GraphEdge> edges_;
  std::vector<std::vector<int>> leaving_;
};

/// Cost of the cheapest path from `start` to every node by a cost per arc, infinite where there is
/// none (Dijkstra's algorithm). O(arcs log nodes).
Eigen::VectorXd shortest_paths_from(const Graph& graph, const std::vector<double>& arc_cost,
                                    int start);
/// The same between all pairs of nodes. @throws DataError naming two nodes without a path
Eigen::MatrixXd shortest_paths(const Graph& graph, const std::vector<double>& arc_cost);
/// In metres, and in edges: the paper's geodesic distance, in which its errors are counted.
Eigen::MatrixXd distances(const Graph& graph);
Eigen::MatrixXd segments(const Graph& graph);

/// Without the edges, longest first, that a path over one other node replaces at a length of at
/// most `longer` times theirs: a list of pairs of nearby nodes becomes a network of neighbours.
Graph without_detours(const Graph& graph, double longer);
/// The nodes of the largest connected part, ascending; and the graph between some nodes, numbered
/// in their order.
std::vector<int> largest_part(const Graph& graph);
Graph part(const Graph& graph, const std::vector<int>& nodes);

/// Places of `dimensions` coordinates whose distances approximate the given ones: classical
/// multidimensional scaling (Torgerson 1952). In the unit of the distances. O(n^3).
/// @throws DataError if the distances have fewer positive directions than that
field_core::Places embed(const Eigen::MatrixXd& distances, int dimensions);

/// The node whose expected distance to where `belief` (a probability per node) says is least.
int least_expected_distance(const Eigen::MatrixXd& distances, const Eigen::VectorXd& belief);

}  // namespace gp_localize
