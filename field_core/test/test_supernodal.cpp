// Factorization by supernodes against dense and simplicial factorization.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <vector>

#include "field_core/cholmod.hpp"
#include "field_core/errors.hpp"
#include "field_core/positive_inverse.hpp"
#include "field_core/random.hpp"
#include "supernodal.hpp"
#include "support.hpp"

using namespace field_core;
using Eigen::MatrixXd;
using Sparse = Eigen::SparseMatrix<double>;

namespace {

MatrixXd random_covariance(int n, Random& random) {
  const MatrixXd root = MatrixXd::NullaryExpr(n, n, [&] { return random.normal(); });
  return root * root.transpose() / n + MatrixXd::Identity(n, n);
}

/// A dense matrix cut into supernodes of `width` columns.
struct DenseNodes {
  DenseNodes(const MatrixXd& m, int width) : n(static_cast<int>(m.cols())) {
    for (int j = 0; j < n; j += width) {
      super.push_back(j);
      pi.push_back(static_cast<int>(s.size()));
      px.push_back(size);
      for (int i = j; i < n; ++i) s.push_back(i);
      size += (n - j) * (std::min(j + width, n) - j);
    }
    super.push_back(n);
    pi.push_back(static_cast<int>(s.size()));
    start.push_back(0);
    for (int j = 0; j < n; ++j) {
      for (int i = n - 1; i >= j; --i) {
        row.push_back(i);
        value.push_back(m(i, j));
      }
      start.push_back(static_cast<int>(row.size()));
    }
    x.assign(static_cast<std::size_t>(size), -7.0);
  }
  int factorize(VectorWidth width) {
    const Supernodes nodes{
        n, static_cast<int>(super.size()) - 1, super.data(), pi.data(), px.data(), s.data()};
    return factorize_supernodes(nodes, {n, start.data(), row.data(), value.data()}, x.data(),
                                panel_product(width));
  }
  double entry(int i, int j) const {
    const auto k = static_cast<std::size_t>(std::upper_bound(super.begin(), super.end(), j) -
                                            super.begin() - 1);
    return x[static_cast<std::size_t>(px[k] + (j - super[k]) * (n - super[k]) + i - super[k])];
  }
  int n, size = 0;
  std::vector<int> super, pi, px, s, start, row;
  std::vector<double> value, x;
};

TEST(Supernodes, FactorIsTheDenseOneByEveryVersionOfTheKernel) {
  Random random(5);
  for (const VectorWidth vector : {VectorWidth::narrow, VectorWidth::avx2, VectorWidth::avx512}) {
    for (const int n : {1, 7, 24, 61, 130}) {
      for (const int width : {1, 5, 24, 60, 130}) {
        const MatrixXd m = random_covariance(n, random);
        const MatrixXd expected = m.llt().matrixL();
        DenseNodes nodes(m, width);
        ASSERT_EQ(nodes.factorize(vector), n);
        double worst = 0.0;
        for (int j = 0; j < n; ++j) {
          for (int i = j; i < n; ++i) {
            worst = std::max(worst, std::abs(nodes.entry(i, j) - expected(i, j)));
          }
        }
        EXPECT_LT(worst, 1e-12) << n << " " << width;
      }
    }
  }
}

TEST(Supernodes, NameTheFirstBadPivot) {
  Random random(6);
  for (const int bad : {0, 3, 30, 59}) {
    MatrixXd m = random_covariance(60, random);
    m(bad, bad) = -1.0;
    DenseNodes nodes(m, 12);
    EXPECT_EQ(nodes.factorize(VectorWidth::avx512), bad);
  }
}

TEST(PositiveInverse, IsTheInverse) {
  Random random(9);
  for (const int n : {1, 5, 40, 130}) {
    MatrixXd m = random_covariance(n, random);
    const MatrixXd expected = m.inverse();
    m.triangularView<Eigen::StrictlyUpper>().setConstant(99.0);
    const MatrixXd inverse = positive_inverse(m);
    EXPECT_LT((inverse - expected).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_EQ(inverse, inverse.transpose());
    m(n / 2, n / 2) = -1.0;
    EXPECT_EQ(positive_inverse(m).size(), 0);
  }
}

/// side x side sites, each tied to those within two rows and columns, and a few far ones.
Sparse lattice(int side, Random& random) {
  const int n = side * side;
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd diagonal = Eigen::VectorXd::Constant(n, 0.3);
  const auto tie = [&](int a, int b) {
    const double w = random.uniform();
    if (a == b) return;
    entries.emplace_back(std::max(a, b), std::min(a, b), -w);
    diagonal[a] += w;
    diagonal[b] += w;
  };
  for (int s = 0; s < n; ++s) {
    for (int dy = 0; dy <= 2; ++dy) {
      for (int dx = 0; dx <= 2; ++dx) {
        if (s % side + dx < side && s / side + dy < side) tie(s, s + dx + dy * side);
      }
    }
    if (s % 17 == 0) tie(s, static_cast<int>(random.uniform(0.0, n - 1.0)));
  }
  for (int s = 0; s < n; ++s) entries.emplace_back(s, s, diagonal[s]);
  Sparse m(n, n);
  m.setFromTriplets(entries.begin(), entries.end());
  return m;
}

TEST(SparseCholesky, SupernodalEqualsSimplicial) {
  Random random(7);
  for (const int side : {1, 3, 12, 33}) {
    const Sparse m = lattice(side, random);
    const int n = side * side;
    std::vector<int> block;
    for (int k = 0; k < n / 3; ++k) block.push_back((7 * k) % n);
    std::sort(block.begin(), block.end());
    block.erase(std::unique(block.begin(), block.end()), block.end());
    for (const bool with_block : {false, true}) {
      if (with_block && block.empty()) continue;
      SparseCholesky plain, fast(Elimination::supernodal);
      for (const double scale : {1.0, 3.0}) {
        const Sparse scaled = scale * m;
        plain.factorize(scaled, with_block ? block : std::vector<int>());
        fast.factorize(scaled, with_block ? block : std::vector<int>());
        EXPECT_EQ(fast.size(), n);
        EXPECT_EQ(fast.analyses(), 1u);
        const MatrixXd rhs = MatrixXd::NullaryExpr(n, 2, [&] { return random.normal(); });
        EXPECT_LT((plain.solve(rhs) - fast.solve(rhs)).cwiseAbs().maxCoeff(), 1e-11);
        EXPECT_NEAR(plain.log_determinant(), fast.log_determinant(), 1e-9);
        const Eigen::VectorXd difference = plain.inverse_diagonal() - fast.inverse_diagonal();
        EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-11);
        if (!with_block) continue;
        const MatrixXd covariance = fast.block_covariance();
        EXPECT_LT((plain.block_covariance() - covariance).cwiseAbs().maxCoeff(), 1e-11);
      }
    }
  }
}

TEST(SparseCholesky, SupernodalRefusesWhatIsNotPositiveDefinite) {
  Random random(8);
  Sparse m = lattice(6, random);
  m.coeffRef(17, 17) = -1.0;
  SparseCholesky factor(Elimination::supernodal);
  test::expect_error<NumericalError>([&] { factor.factorize(m); },
                                     {"not positive definite", "column 17"});
  test::expect_error<NumericalError>([&] { factor.solve(Eigen::VectorXd::Ones(36)); },
                                     {"factorize()"});
  m.coeffRef(17, 17) = 50.0;
  factor.factorize(m);
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(36, -1.0, 1.0);
  const Eigen::VectorXd rhs = m.selfadjointView<Eigen::Lower>() * x;
  EXPECT_LT((factor.solve(rhs) - x).norm(), 1e-12);
}

}  // namespace
