#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "gp_localize/support_set.hpp"

using namespace gp_localize;
using field_core::Kernel;
using field_core::KernelType;

namespace {

const Kernel kKernel(KernelType::squared_exponential, 1.0, {2.0, 2.0});

SupportParams params(SupportSelection selection, int size) {
  SupportParams p;
  p.selection = selection;
  p.size = size;
  p.region = {0.0, 0.0, 10.0, 5.0};
  return p;
}

double smallest_distance(const Eigen::Matrix2Xd& s) {
  double smallest = 1e9;
  for (Eigen::Index i = 0; i < s.cols(); ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      smallest = std::min(smallest, (s.col(i) - s.col(j)).norm());
    }
  }
  return smallest;
}

TEST(SupportSet, GridIsCellCentresOfSquareCells) {
  const auto s = select_support(params(SupportSelection::grid, 8), kKernel, 0.1);
  ASSERT_EQ(s.cols(), 8);
  EXPECT_EQ(s.col(0), Eigen::Vector2d(1.25, 1.25));
  EXPECT_EQ(s.col(7), Eigen::Vector2d(8.75, 3.75));
}

TEST(SupportSet, GridFillsTheBudgetNearly) {
  for (const int size : {1, 7, 40, 399}) {
    const auto n = select_support(params(SupportSelection::grid, size), kKernel, 0.1).cols();
    EXPECT_LE(n, size);
    EXPECT_GE(n, size - 1 - size / 7);
  }
}

TEST(SupportSet, EveryRuleStaysInTheRegionAndSpreads) {
  for (const auto rule : {SupportSelection::grid, SupportSelection::farthest_point,
                          SupportSelection::mutual_information}) {
    const auto s = select_support(params(rule, 20), kKernel, 0.01);
    ASSERT_GE(s.cols(), 18);
    EXPECT_GE(s.row(0).minCoeff(), 0.0);
    EXPECT_LE(s.row(0).maxCoeff(), 10.0);
    EXPECT_GE(s.row(1).minCoeff(), 0.0);
    EXPECT_LE(s.row(1).maxCoeff(), 5.0);
    // 20 points on 50 m^2: a hexagonal packing has 1.7 m; at random one would see 0.2 m.
    EXPECT_GT(smallest_distance(s), 0.7);
  }
}

TEST(SupportSet, FarthestPointStartsAtTheCentreAndReachesTheCorners) {
  const auto s = select_support(params(SupportSelection::farthest_point, 5), kKernel, 0.1);
  EXPECT_LT((s.col(0) - Eigen::Vector2d(5.0, 2.5)).norm(), 0.5);
  for (int i = 1; i < 5; ++i) EXPECT_GT((s.col(i) - s.col(0)).norm(), 4.5);
}

// Greedy mutual information recomputed by definition: for each candidate the ratio of its variance
// given the chosen to its variance given all others, by dense solves.
TEST(SupportSet, MutualInformationIsTheGreedyChoice) {
  const auto p = params(SupportSelection::mutual_information, 3);
  const auto chosen = select_support(p, kKernel, 0.05);
  const auto all = select_support(params(SupportSelection::grid, 400), kKernel, 0.05);
  Eigen::MatrixXd k = kKernel.matrix(all, all);
  k.diagonal().array() += 0.05;
  std::vector<Eigen::Index> a;
  for (int step = 0; step < 3; ++step) {
    double best = -1.0, of_chosen = 0.0;
    Eigen::Index picked = 0;
    for (Eigen::Index y = 0; y < all.cols(); ++y) {
      if (std::find(a.begin(), a.end(), y) != a.end()) continue;
      if (y % 7 != 0 && all.col(y) != chosen.col(step)) continue;  // a sample of rivals is enough
      const auto variance_given = [&](const std::vector<Eigen::Index>& set) {
        if (set.empty()) return k(y, y);
        Eigen::MatrixXd kk(set.size(), set.size());
        Eigen::VectorXd c(set.size());
        for (std::size_t i = 0; i < set.size(); ++i) {
          c[i] = k(y, set[i]);
          for (std::size_t j = 0; j < set.size(); ++j) kk(i, j) = k(set[i], set[j]);
        }
        return k(y, y) - c.dot(kk.ldlt().solve(c));
      };
      std::vector<Eigen::Index> others;
      for (Eigen::Index i = 0; i < all.cols(); ++i) {
        if (i != y && std::find(a.begin(), a.end(), i) == a.end()) others.push_back(i);
      }
      const double ratio = variance_given(a) / variance_given(others);
      if (all.col(y) == chosen.col(step)) {
        of_chosen = ratio;
        picked = y;
      }
      best = std::max(best, ratio);
    }
    EXPECT_NEAR(of_chosen, best, 1e-6 * best) << "step " << step;
    a.push_back(picked);
  }
}

}  // namespace
