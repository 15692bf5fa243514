#include "gp_localize/graph_domain.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <queue>
#include <set>
#include <string>

#include "field_core/errors.hpp"

namespace gp_localize {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

std::string name(const GraphEdge& e) {
  return "the edge between nodes " + std::to_string(e.from) + " and " + std::to_string(e.to);
}

void check(const GraphEdge& e, int nodes, std::set<std::pair<int, int>>& known) {
  if (std::min(e.from, e.to) < 0 || std::max(e.from, e.to) >= nodes) {
    throw field_core::DataError(name(e) +
                                " names a node that does not exist; there are nodes 0 to " +
                                std::to_string(nodes - 1));
  }
  if (e.from == e.to) throw field_core::DataError(name(e) + " is a loop; leave it out");
  if (!(e.length > 0.0) || !std::isfinite(e.length)) {
    throw field_core::DataError(name(e) + " has no positive length; correct or leave it out");
  }
  if (!known.insert(std::minmax(e.from, e.to)).second) {
    throw field_core::DataError(name(e) + " is given twice; keep one of them");
  }
}

}  // namespace

Graph::Graph(int nodes, std::vector<GraphEdge> edges) : edges_(std::move(edges)), leaving_(nodes) {
  std::set<std::pair<int, int>> known;
  for (const GraphEdge& edge : edges_) check(edge, nodes, known);
  for (int arc = 0; arc < arcs(); ++arc) leaving_[tail(arc)].push_back(arc);
}

Eigen::VectorXd shortest_paths_from(const Graph& graph, const std::vector<double>& cost,
                                    int start) {
  using Reached = std::pair<double, int>;
  Eigen::VectorXd best = Eigen::VectorXd::Constant(graph.nodes(), kInfinite);
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> open;
  best[start] = 0.0;
  open.emplace(0.0, start);
  while (!open.empty()) {
    const auto [so_far, node] = open.top();
    open.pop();
    if (so_far > best[node]) continue;
    for (const int arc : graph.leaving(node)) {
      const double there = so_far + cost[arc];
      if (there >= best[graph.head(arc)]) continue;
      best[graph.head(arc)] = there;
      open.emplace(there, graph.head(arc));
    }
  }
  return best;
}

Eigen::MatrixXd shortest_paths(const Graph& graph, const std::vector<double>& arc_cost) {
  Eigen::MatrixXd all(graph.nodes(), graph.nodes());
  for (int node = 0; node < graph.nodes(); ++node) {
    all.row(node) = shortest_paths_from(graph, arc_cost, node).transpose();
    Eigen::Index worst;
    if (std::isfinite(all.row(node).maxCoeff(&worst))) continue;
    throw field_core::DataError("the graph is not connected: no path leads from node " +
                                std::to_string(node) + " to node " + std::to_string(worst) +
                                "; add edges, or keep the largest connected part only");
  }
  return all;
}

Eigen::MatrixXd distances(const Graph& graph) {
  std::vector<double> lengths(graph.arcs());
  for (int arc = 0; arc < graph.arcs(); ++arc) lengths[arc] = graph.length(arc);
  return shortest_paths(graph, lengths);
}

Eigen::MatrixXd segments(const Graph& graph) {
  return shortest_paths(graph, std::vector<double>(graph.arcs(), 1.0));
}

Graph without_detours(const Graph& graph, double longer) {
  const auto n = static_cast<Eigen::Index>(graph.nodes());
  Eigen::MatrixXd length = Eigen::MatrixXd::Constant(n, n, kInfinite);
  for (const GraphEdge& e : graph.edges()) length(e.from, e.to) = length(e.to, e.from) = e.length;
  std::vector<GraphEdge> by_length = graph.edges();
  std::stable_sort(by_length.begin(), by_length.end(),
                   [](const auto& a, const auto& b) { return a.length > b.length; });
  std::vector<GraphEdge> kept;
  for (const GraphEdge& e : by_length) {
    // A column is infinite at its own node, so that the edge itself is no detour.
    const double detour = (length.col(e.from) + length.col(e.to)).minCoeff();
    if (detour <= longer * e.length) {
      length(e.from, e.to) = length(e.to, e.from) = kInfinite;
    } else {
      kept.push_back(e);
    }
  }
  return {graph.nodes(), kept};
}

std::vector<int> largest_part(const Graph& graph) {
  const std::vector<double> no_cost(graph.arcs(), 0.0);
  std::vector<bool> seen(graph.nodes(), false);
  std::vector<int> largest;
  for (int start = 0; start < graph.nodes(); ++start) {
    if (seen[start]) continue;
    const Eigen::VectorXd reached = shortest_paths_from(graph, no_cost, start);
    std::vector<int> nodes;
    for (int node = 0; node < graph.nodes(); ++node) {
      if (reached[node] == 0.0) nodes.push_back(node);
    }
    for (const int node : nodes) seen[node] = true;
    if (nodes.size() > largest.size()) largest = nodes;
  }
  return largest;
}

Graph part(const Graph& graph, const std::vector<int>& nodes) {
  std::vector<int> number(graph.nodes(), -1);
  for (std::size_t i = 0; i < nodes.size(); ++i) number[nodes[i]] = static_cast<int>(i);
  std::vector<GraphEdge> edges;
  for (const GraphEdge& e : graph.edges()) {
    if (number[e.from] < 0 || number[e.to] < 0) continue;
    edges.push_back({number[e.from], number[e.to], e.length});
  }
  return {static_cast<int>(nodes.size()), edges};
}

field_core::Places embed(const Eigen::MatrixXd& distances, int dimensions) {
  const Eigen::Index n = distances.rows();
  Eigen::MatrixXd inner = -0.5 * distances.cwiseAbs2();
  inner.colwise() -= inner.rowwise().mean().eval();
  inner.rowwise() -= inner.colwise().mean().eval();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(inner);  // ascending
  field_core::Places places(dimensions, n);
  for (int i = 0; i < dimensions; ++i) {
    const Eigen::Index k = n - 1 - i;
    if (k < 0 || !(solver.eigenvalues()[k] > 1e-9 * solver.eigenvalues()[n - 1])) {
      throw field_core::DataError("the distances cannot be embedded in " +
                                  std::to_string(dimensions) + " dimensions; use " +
                                  std::to_string(i));
    }
    Eigen::VectorXd axis = solver.eigenvectors().col(k) * std::sqrt(solver.eigenvalues()[k]);
    Eigen::Index largest;
    axis.cwiseAbs().maxCoeff(&largest);
    if (axis[largest] < 0.0) axis = -axis;  // either sign would do: always the same
    places.row(i) = axis.transpose();
  }
  return places;
}

int least_expected_distance(const Eigen::MatrixXd& distances, const Eigen::VectorXd& belief) {
  Eigen::Index best;
  (distances * belief).minCoeff(&best);
  return static_cast<int>(best);
}

}  // namespace gp_localize
