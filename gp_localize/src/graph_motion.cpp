#include "gp_localize/graph_motion.hpp"

#include <algorithm>
#include <string>

#include "field_core/errors.hpp"

namespace gp_localize {
namespace {

void require_node(const Graph& graph, int node, std::size_t step) {
  if (node >= 0 && node < graph.nodes()) return;
  throw field_core::DataError(
      "step " + std::to_string(step) + " of the route is at node " + std::to_string(node) +
      ", which does not exist; there are nodes 0 to " + std::to_string(graph.nodes() - 1));
}

}  // namespace

GraphMotion::GraphMotion(Graph graph)
    : graph_(std::move(graph)),
      held_(Eigen::VectorXd::Zero(graph_.nodes())),
      left_(Eigen::VectorXd::Zero(graph_.nodes())) {
  for (int node = 0; node < graph_.nodes(); ++node) {
    if (!graph_.leaving(node).empty()) continue;
    throw field_core::DataError("node " + std::to_string(node) +
                                " has no edge: nothing gets there; leave it out");
  }
  for (int arc = 0; arc < graph_.arcs(); ++arc) {
    turn_counts_.push_back(
        Eigen::VectorXd::Zero(static_cast<Eigen::Index>(graph_.leaving(graph_.head(arc)).size())));
  }
  estimate_turns();
}

int GraphMotion::place_of(int arc) const {
  const auto& leaving = graph_.leaving(graph_.tail(arc));
  return static_cast<int>(std::find(leaving.begin(), leaving.end(), arc) - leaving.begin());
}

void GraphMotion::learn(const std::vector<int>& route) {
  int last = -1;  // arc
  for (std::size_t step = 0; step < route.size(); ++step) {
    require_node(graph_, route[step], step);
    if (step == 0) continue;
    const int from = route[step - 1], to = route[step];
    if (from == to) {
      held_[from] += 1.0;
      continue;
    }
    const auto& leaving = graph_.leaving(from);
    const auto taken = std::find_if(leaving.begin(), leaving.end(),
                                    [&](int arc) { return graph_.head(arc) == to; });
    if (taken == leaving.end()) {
      throw field_core::DataError("step " + std::to_string(step) + " of the route goes from node " +
                                  std::to_string(from) + " to node " + std::to_string(to) +
                                  ", which is no neighbour");
    }
    left_[from] += 1.0;
    if (last >= 0) turn_counts_[last][place_of(*taken)] += 1.0;
    last = *taken;
  }
  estimate_turns();
}

double GraphMotion::hold(int node) const {
  return (held_[node] + 1.0) / (held_[node] + left_[node] + 2.0);
}

void GraphMotion::estimate_turns() {
  turns_ = turn_counts_;
  for (int node = 0; node < graph_.nodes(); ++node) {
    const auto& leaving = graph_.leaving(node);
    Eigen::VectorXd at_node = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(leaving.size()));
    for (const int arc : leaving) at_node += turn_counts_[arc ^ 1];
    at_node *= kBackOff / at_node.sum();
    for (const int arc : leaving) {
      turns_[arc ^ 1] += at_node;
      turns_[arc ^ 1] /= turns_[arc ^ 1].sum();
    }
  }
}

int GraphMotion::move(int arc, field_core::Random& random) const {
  const int node = graph_.head(arc);
  if (random.uniform() < hold(node)) return arc;
  const Eigen::VectorXd& p = turns_[arc];
  double rest = random.uniform();
  Eigen::Index k = 0;
  while (k + 1 < p.size() && rest >= p[k]) rest -= p[k++];
  return graph_.leaving(node)[k];
}

int GraphMotion::arrive(int node, field_core::Random& random) const {
  const auto& leaving = graph_.leaving(node);
  return leaving[random.index(leaving.size())] ^ 1;
}

Eigen::VectorXd GraphMotion::forward(const Eigen::VectorXd& belief) const {
  Eigen::VectorXd next = Eigen::VectorXd::Zero(graph_.arcs());
  for (int arc = 0; arc < graph_.arcs(); ++arc) {
    if (belief[arc] == 0.0) continue;
    const int node = graph_.head(arc);
    const double stays = hold(node);
    next[arc] += stays * belief[arc];
    const Eigen::VectorXd p = (1.0 - stays) * belief[arc] * turns_[arc];
    for (Eigen::Index k = 0; k < p.size(); ++k) next[graph_.leaving(node)[k]] += p[k];
  }
  return next;
}

Eigen::VectorXd GraphMotion::nodes(const Eigen::VectorXd& belief) const {
  Eigen::VectorXd sums = Eigen::VectorXd::Zero(graph_.nodes());
  for (int arc = 0; arc < graph_.arcs(); ++arc) sums[graph_.head(arc)] += belief[arc];
  return sums;
}

}  // namespace gp_localize
