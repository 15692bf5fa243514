// Graphs as domains of a field, and motion on them.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <limits>

#include "field_core/errors.hpp"
#include "field_core/random.hpp"
#include "gp_localize/graph_domain.hpp"
#include "gp_localize/graph_motion.hpp"

using namespace gp_localize;

namespace {

/// columns x rows crossroads, 100 m apart along a row and 150 m across.
Graph grid(int columns, int rows) {
  std::vector<GraphEdge> edges;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const int node = j * columns + i;
      if (i + 1 < columns) edges.push_back({node, node + 1, 100.0});
      if (j + 1 < rows) edges.push_back({node + columns, node, 150.0});
    }
  }
  return {columns * rows, edges};
}

Graph random_graph(int nodes, std::uint64_t seed) {
  field_core::Random random(seed);
  std::vector<GraphEdge> edges;
  for (int i = 1; i < nodes; ++i) {  // a tree, and chords
    edges.push_back({static_cast<int>(random.index(i)), i, random.uniform(1.0, 9.0)});
  }
  for (int i = 0; i + 5 < nodes; i += 2) {
    const int to = i + 2 + static_cast<int>(random.index(3));
    const auto same = [&](const GraphEdge& e) { return e.from == i && e.to == to; };
    if (std::any_of(edges.begin(), edges.end(), same)) continue;
    edges.push_back({i, to, random.uniform(1.0, 9.0)});
  }
  return {nodes, edges};
}

/// By Floyd and Warshall.
Eigen::MatrixXd all_pairs(const Graph& g) {
  constexpr double kFar = 1e9;
  Eigen::MatrixXd d = Eigen::MatrixXd::Constant(g.nodes(), g.nodes(), kFar);
  d.diagonal().setZero();
  for (const GraphEdge& e : g.edges()) d(e.from, e.to) = d(e.to, e.from) = e.length;
  for (int k = 0; k < g.nodes(); ++k) {
    for (int i = 0; i < g.nodes(); ++i) {
      for (int j = 0; j < g.nodes(); ++j) d(i, j) = std::min(d(i, j), d(i, k) + d(k, j));
    }
  }
  return d;
}

template <class Call>
std::string error_of(Call call) {
  try {
    call();
  } catch (const field_core::DataError& e) {
    return e.what();
  }
  return "no error";
}

TEST(Graph, ArcsKnowTheirEnds) {
  const Graph g(3, {{0, 1, 5.0}, {2, 1, 7.0}});
  EXPECT_EQ(g.arcs(), 4);
  EXPECT_EQ(g.tail(2), 2);
  EXPECT_EQ(g.head(2), 1);
  EXPECT_EQ(g.head(3), 2);
  EXPECT_EQ(g.length(3), 7.0);
  EXPECT_EQ(g.leaving(1), (std::vector<int>{1, 3}));
}

TEST(Graph, DistancesAreThoseOfFloydAndWarshall) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const Graph g = random_graph(25, seed);
    EXPECT_LT((distances(g) - all_pairs(g)).cwiseAbs().maxCoeff(), 1e-12);
  }
  EXPECT_EQ(segments(grid(4, 3))(0, 11), 5.0);
  EXPECT_EQ(distances(grid(4, 3))(0, 11), 600.0);
}

TEST(Graph, WithoutDetoursLeavesTheNetworkThatPairsWereMadeFrom) {
  const Graph street = grid(5, 1);
  const Eigen::MatrixXd far = distances(street);
  std::vector<GraphEdge> pairs;  // every pair within three crossroads
  for (int i = 0; i < 5; ++i) {
    for (int j = i + 1; j < std::min(5, i + 4); ++j) pairs.push_back({i, j, far(i, j)});
  }
  const Graph thinned = without_detours(Graph(5, pairs), 1.1);
  EXPECT_EQ(thinned.edges().size(), 4u);
  EXPECT_LT((distances(thinned) - far).cwiseAbs().maxCoeff(), 1e-12);
  // A way round that is much longer is no reason to drop an edge.
  EXPECT_EQ(without_detours(Graph(3, {{0, 1, 10}, {1, 2, 10}, {0, 2, 15}}), 1.1).edges().size(),
            3u);
}

TEST(Graph, TheLargestPartIsKept) {
  const Graph g(6, {{4, 5, 1.0}, {1, 3, 2.0}, {3, 0, 3.0}});
  const std::vector<int> nodes = largest_part(g);
  EXPECT_EQ(nodes, (std::vector<int>{0, 1, 3}));
  const Graph kept = part(g, nodes);
  EXPECT_EQ(kept.nodes(), 3);
  EXPECT_EQ(distances(kept)(0, 1), 5.0);
}

TEST(Graph, BadEdgesAndMissingPathsAreNamed) {
  const auto make = [](GraphEdge e) { return [e] { Graph(3, {{0, 1, 1.0}, e}); }; };
  EXPECT_NE(error_of(make({0, 3, 1.0})).find("does not exist"), std::string::npos);
  EXPECT_NE(error_of(make({-1, 2, 1.0})).find("does not exist"), std::string::npos);
  EXPECT_NE(error_of(make({2, 2, 1.0})).find("loop"), std::string::npos);
  EXPECT_NE(error_of(make({1, 0, 1.0})).find("twice"), std::string::npos);
  for (const double length : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_NE(error_of(make({1, 2, length})).find("no positive length"), std::string::npos);
  }
  const std::string apart = error_of([] { distances(Graph(3, {{0, 1, 1.0}})); });
  EXPECT_NE(apart.find("not connected"), std::string::npos);
  EXPECT_NE(apart.find("node 2"), std::string::npos);
}

TEST(Embedding, OfPointsOfThePlaneIsExact) {
  Eigen::Matrix2Xd points = Eigen::Matrix2Xd::Random(2, 20) * 7.0;
  Eigen::MatrixXd far(20, 20);
  for (int i = 0; i < 20; ++i) {
    for (int j = 0; j < 20; ++j) far(i, j) = (points.col(i) - points.col(j)).norm();
  }
  const field_core::Places places = embed(far, 2);
  for (int i = 0; i < 20; ++i) {
    for (int j = 0; j < 20; ++j) {
      EXPECT_NEAR((places.col(i) - places.col(j)).norm(), far(i, j), 1e-9);
    }
  }
  EXPECT_NE(error_of([&] { embed(far, 3); }).find("use 2"), std::string::npos);
}

/// A line is straight in one dimension; a grid's shortest paths are no straight lines, and what is
/// left of them is known: (|dx| + |dy|) against sqrt(dx^2 + dy^2), a quarter at most after scaling.
TEST(Embedding, DistancesApproachShortestPaths) {
  const Eigen::MatrixXd line = distances(grid(6, 1));
  const field_core::Places on_line = embed(line, 1);
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(std::abs(on_line(0, i) - on_line(0, 0)), 100.0 * i, 1e-9);
  const Eigen::MatrixXd paths = distances(grid(6, 4));
  const field_core::Places places = embed(paths, 2);
  double error = 0.0;
  for (int i = 0; i < 24; ++i) {
    for (int j = 0; j < 24; ++j) {
      const double embedded = (places.col(i) - places.col(j)).norm();
      EXPECT_NEAR(embedded, paths(i, j), 0.25 * paths.maxCoeff());
      error += std::abs(embedded - paths(i, j));
    }
  }
  EXPECT_LT(error / paths.sum(), 0.13);  // 0.117
}

TEST(Graph, TheEstimateHasTheLeastExpectedDistance) {
  const Eigen::MatrixXd d = segments(grid(5, 1));
  // Most likely is node 0, but node 2 is nearer to most of the rest.
  Eigen::VectorXd belief(5);
  belief << 0.4, 0.0, 0.15, 0.15, 0.3;
  EXPECT_EQ(least_expected_distance(d, belief), 2);
  EXPECT_EQ(least_expected_distance(d, Eigen::VectorXd::Unit(5, 4)), 4);
}

TEST(GraphMotion, KnowsNothingAtFirst) {
  const GraphMotion motion(grid(3, 3));
  EXPECT_EQ(motion.hold(4), 0.5);
  for (int arc = 0; arc < motion.graph().arcs(); ++arc) {
    const Eigen::VectorXd& p = motion.turns(arc);
    EXPECT_NEAR(p.sum(), 1.0, 1e-15);
    EXPECT_NEAR(p.maxCoeff(), p.minCoeff(), 1e-15);
  }
}

TEST(GraphMotion, CountsBecomeProbabilities) {
  GraphMotion motion(grid(3, 1));  // 0 - 1 - 2
  motion.learn({0, 0, 1, 2, 1, 1, 1, 2});
  EXPECT_NEAR(motion.hold(0), (1.0 + 1.0) / (2.0 + 2.0), 1e-15);
  EXPECT_NEAR(motion.hold(1), (2.0 + 1.0) / (4.0 + 2.0), 1e-15);
  // Arcs 0: 0->1, 1: 1->0, 2: 1->2, 3: 2->1. After arc 0 the route went on to 2 once, after arc 3
  // once; so all turns at node 1 went to 2: (1 + 0, 1 + 2) / 4 at the node.
  const double back_off = GraphMotion::kBackOff * 3.0 / 4.0;
  EXPECT_NEAR(motion.turns(0)[1], (1.0 + back_off) / (1.0 + GraphMotion::kBackOff), 1e-15);
  EXPECT_NEAR(motion.turns(3)[1], motion.turns(0)[1], 1e-15);
}

TEST(GraphMotion, LearnsTheTurnsOfRoutesThatItDrewItself) {
  const Graph g = grid(3, 3);
  GraphMotion truth(g), learned(g);
  field_core::Random random(5);
  truth.learn({0, 1, 4, 4, 7, 8, 5, 4, 3, 0, 1, 4, 7, 8, 5, 4, 3, 0, 1, 2, 2, 5});
  int arc = truth.arrive(0, random);
  std::vector<int> route{0};
  for (int step = 0; step < 60000; ++step) {
    arc = truth.move(arc, random);
    route.push_back(g.head(arc));
  }
  learned.learn(route);
  for (int a = 0; a < g.arcs(); ++a) {  // 1200 visits or more: sd below 0.015, and four of them
    EXPECT_LT((learned.turns(a) - truth.turns(a)).cwiseAbs().maxCoeff(), 0.06);
  }
  for (int node = 0; node < 9; ++node) EXPECT_NEAR(learned.hold(node), truth.hold(node), 0.03);
}

TEST(GraphMotion, ForwardIsTheDistributionOfMove) {
  const Graph g = grid(3, 3);
  GraphMotion motion(g);
  motion.learn({0, 1, 4, 7, 8, 5, 4, 3, 0, 1, 2});
  Eigen::VectorXd belief = Eigen::VectorXd::Unit(g.arcs(), 4);
  field_core::Random random(9);
  constexpr int kDraws = 100000;
  Eigen::VectorXd drawn = Eigen::VectorXd::Zero(g.arcs());
  for (int i = 0; i < kDraws; ++i) drawn[motion.move(motion.move(4, random), random)] += 1.0;
  const Eigen::VectorXd exact = motion.forward(motion.forward(belief));
  EXPECT_NEAR(exact.sum(), 1.0, 1e-14);
  EXPECT_LT((drawn / kDraws - exact).cwiseAbs().maxCoeff(), 5.0 * 0.5 / std::sqrt(kDraws));
  EXPECT_NEAR(motion.nodes(exact).sum(), 1.0, 1e-14);
}

TEST(GraphMotion, BadRoutesAreNamed) {
  GraphMotion motion(grid(3, 3));
  EXPECT_NE(error_of([&] { motion.learn({0, 1, 9}); }).find("step 2"), std::string::npos);
  EXPECT_NE(error_of([&] { motion.learn({0, 4}); }).find("no neighbour"), std::string::npos);
  EXPECT_NE(error_of([] {
              GraphMotion(Graph(3, {{0, 1, 1.0}}));
            }).find("node 2"),
            std::string::npos);
}

}  // namespace
