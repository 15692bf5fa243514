#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "field_core/cholmod.hpp"
#include "field_core/errors.hpp"
#include "field_core/random.hpp"
#include "support.hpp"

namespace field_core {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

// Precision matrix of a side x side grid: graph Laplacian plus a prior. Both triangles are filled.
Sparse grid_precision(int side, double prior) {
  std::vector<Eigen::Triplet<double>> entries;
  const auto add_edge = [&](int a, int b) {
    entries.emplace_back(a, a, 1.0);
    entries.emplace_back(b, b, 1.0);
    entries.emplace_back(a, b, -1.0);
    entries.emplace_back(b, a, -1.0);
  };
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const int node = y * side + x;
      entries.emplace_back(node, node, prior * (1.0 + 0.01 * node));
      if (x + 1 < side) add_edge(node, node + 1);
      if (y + 1 < side) add_edge(node, node + side);
    }
  }
  Sparse m(side * side, side * side);
  m.setFromTriplets(entries.begin(), entries.end());
  return m;
}

TEST(SparseCholesky, AgreesWithTheDenseFactor) {
  const Sparse m = grid_precision(9, 0.3);
  const Eigen::LDLT<Eigen::MatrixXd> dense((Eigen::MatrixXd(m)));
  SparseCholesky sparse;
  sparse.factorize(m);
  ASSERT_EQ(sparse.size(), 81);
  Random random(30);
  Eigen::MatrixXd rhs(81, 3);
  for (Eigen::Index i = 0; i < rhs.size(); ++i) rhs(i) = random.normal();
  // Condition number below 8 / 0.3: 1e-12 leaves three digits to spare.
  EXPECT_NEAR((sparse.solve(rhs) - dense.solve(rhs)).norm(), 0.0, 1e-12);
  EXPECT_NEAR(sparse.log_determinant(), dense.vectorD().array().log().sum(), 1e-11);
  // A block of a larger matrix: its columns are further apart than its rows are many.
  Eigen::MatrixXd wide = Eigen::MatrixXd::Zero(100, 4);
  wide.block(10, 1, 81, 2) = rhs.leftCols(2);
  EXPECT_EQ(sparse.solve(wide.block(10, 1, 81, 2)), sparse.solve(rhs.leftCols(2)));
  EXPECT_EQ(sparse.solve(Eigen::MatrixXd(81, 0)).cols(), 0);
}

TEST(SparseCholesky, OnlyTheLowerTriangleIsRead) {
  const Sparse full = grid_precision(5, 1.0);
  Sparse garbage = full;
  for (int j = 0; j < garbage.outerSize(); ++j) {
    for (Sparse::InnerIterator it(garbage, j); it; ++it) {
      if (it.row() < it.col()) it.valueRef() = 1e6;
    }
  }
  const Sparse lower = full.triangularView<Eigen::Lower>();
  SparseCholesky a, b, c;
  a.factorize(full);
  b.factorize(garbage);
  c.factorize(lower);
  const Eigen::VectorXd rhs = Eigen::VectorXd::LinSpaced(25, -1.0, 1.0);
  EXPECT_EQ(a.solve(rhs), b.solve(rhs));
  EXPECT_NEAR((a.solve(rhs) - c.solve(rhs)).norm(), 0.0, 1e-13);
}

TEST(SparseCholesky, AnalysisIsReusedWhileThePatternStays) {
  SparseCholesky sparse;
  const Eigen::VectorXd rhs = Eigen::VectorXd::Ones(36);
  for (const double prior : {1.0, 2.0, 3.0}) {
    const Sparse m = grid_precision(6, prior);
    sparse.factorize(m);
    EXPECT_NEAR((m * sparse.solve(rhs) - rhs).norm(), 0.0, 1e-12);
    EXPECT_EQ(sparse.analyses(), 1u);
  }
  Sparse denser = grid_precision(6, 1.0);
  denser.coeffRef(35, 0) = 0.1;
  denser.makeCompressed();
  sparse.factorize(denser);
  EXPECT_EQ(sparse.analyses(), 2u);
  sparse.factorize(grid_precision(5, 1.0));
  EXPECT_EQ(sparse.analyses(), 3u);
  EXPECT_EQ(sparse.size(), 25);
}

// Nodes that hang on nothing: a diagonal entry of 0 or below is a pivot that no ordering can save.
TEST(SparseCholesky, NotPositiveDefiniteNamesTheColumn) {
  for (const int column : {0, 7, 24}) {
    for (const double pivot : {0.0, -2.0}) {
      Sparse m = grid_precision(5, 1.0);
      for (int j = 0; j < m.outerSize(); ++j) {
        for (Sparse::InnerIterator it(m, j); it; ++it) {
          if (it.row() == column || it.col() == column) it.valueRef() = 0.0;
        }
      }
      m.coeffRef(column, column) = pivot;
      SparseCholesky sparse;
      test::expect_error<NumericalError>(
          [&] { sparse.factorize(m); },
          {"25 x 25", "not positive definite", "column " + std::to_string(column) + " ", "prior"});
      test::expect_error<NumericalError>([&] { sparse.log_determinant(); }, {"factorize()"});
      EXPECT_EQ(sparse.size(), 0);
      sparse.factorize(grid_precision(5, 1.0));  // usable again, without a new analysis
      EXPECT_EQ(sparse.analyses(), 1u);
      EXPECT_TRUE(sparse.solve(Eigen::VectorXd::Ones(25)).allFinite());
    }
  }
}

TEST(SparseCholesky, MisuseIsATypedError) {
  SparseCholesky sparse;
  const Eigen::VectorXd rhs = Eigen::VectorXd::Ones(4);
  test::expect_error<NumericalError>([&] { sparse.solve(rhs); }, {"factorize()"});
  test::expect_error<NumericalError>([&] { sparse.factorize(Sparse(3, 4)); }, {"3 x 4"});
  test::expect_error<NumericalError>([&] { sparse.factorize(Sparse(0, 0)); }, {"0 x 0"});
  Sparse loose(4, 4);
  loose.reserve(Eigen::VectorXi::Constant(4, 3));
  loose.insert(0, 0) = 1.0;
  test::expect_error<NumericalError>([&] { sparse.factorize(loose); }, {"makeCompressed"});
  Sparse bad = grid_precision(2, 1.0);
  bad.coeffRef(2, 2) = std::nan("");
  test::expect_error<NumericalError>([&] { sparse.factorize(bad); }, {"not finite", "column 2"});
  sparse.factorize(grid_precision(2, 1.0));
  test::expect_error<NumericalError>([&] { sparse.solve(Eigen::VectorXd::Ones(5)); }, {"5", "4"});
}

TEST(SparseCholesky, SelectedInverseIsTheDiagonalOfTheDenseInverse) {
  SparseCholesky sparse;
  test::expect_error<NumericalError>([&] { sparse.inverse_diagonal(); }, {"factorize()"});
  for (const int k : {1, 4, 13}) {
    Sparse m = grid_precision(k, 0.3);
    for (int i = 0; i < k * k; i += 3) m.coeffRef(i, i) += 0.1 * i;  // no symmetry to hide behind
    sparse.factorize(m);
    const Eigen::MatrixXd full = Eigen::MatrixXd(m).selfadjointView<Eigen::Lower>();
    const Eigen::VectorXd expected = full.inverse().diagonal();
    // Condition below 30: both computations are good to some 1e-14.
    EXPECT_LT((sparse.inverse_diagonal() - expected).cwiseAbs().maxCoeff(), 1e-12) << k;
  }
}

TEST(SparseCholesky, ABlockKeptForLastGivesItsRowsAndColumnsOfTheInverse) {
  Sparse m = grid_precision(9, 0.3);
  for (int i = 0; i < 81; i += 3) m.coeffRef(i, i) += 0.1 * i;
  const Eigen::MatrixXd inverse = Eigen::MatrixXd(m).inverse();
  SparseCholesky sparse;
  std::vector<int> large;  // more than the blocks that the inverse is computed in
  for (int k = 0; k < 70; ++k) large.push_back((17 * k) % 81);
  sparse.factorize(m, large);
  EXPECT_NEAR(sparse.block_covariance()(69, 3), inverse(large[69], large[3]), 1e-12);
  EXPECT_NEAR(sparse.block_covariance()(0, 60), inverse(large[0], large[60]), 1e-12);
  const std::vector<int> block = {40, 3, 80, 41, 0, 39};
  sparse.factorize(m, block);
  const Eigen::MatrixXd covariance = sparse.block_covariance();
  for (std::size_t a = 0; a < block.size(); ++a) {
    for (std::size_t b = 0; b < block.size(); ++b) {
      EXPECT_NEAR(covariance(static_cast<int>(a), static_cast<int>(b)), inverse(block[a], block[b]),
                  1e-12);
    }
  }
  const Eigen::VectorXd rhs = Eigen::VectorXd::LinSpaced(81, -1.0, 1.0);
  EXPECT_LT((sparse.solve(rhs) - inverse * rhs).norm(), 1e-11);
  sparse.factorize(m, block);
  EXPECT_EQ(sparse.analyses(), 2u);
  const Sparse pattern = m.triangularView<Eigen::Lower>();
  const Sparse selected = sparse.selected_inverse(pattern);
  EXPECT_EQ(selected.nonZeros(), pattern.nonZeros());
  for (int j = 0; j < 81; ++j) {
    for (Sparse::InnerIterator it(selected, j); it; ++it) {
      EXPECT_GE(it.row(), j);
      EXPECT_NEAR(it.value(), inverse(it.row(), j), 1e-12);
    }
  }
  test::expect_error<NumericalError>([&] { sparse.solve(rhs); }, {"factorize()"});  // used up
  sparse.factorize(m);                                                              // another order
  EXPECT_EQ(sparse.analyses(), 3u);
  Sparse far(81, 81);
  far.insert(72, 8) = 1.0;  // two corners, eliminated first
  test::expect_error<NumericalError>([&] { sparse.selected_inverse(far); }, {"row 72", "column 8"});
  sparse.factorize(m);
  test::expect_error<NumericalError>([&] { sparse.block_covariance(); }, {"factorize()"});
}

TEST(SparseCholesky, MovesKeepTheFactor) {
  SparseCholesky a;
  a.factorize(grid_precision(3, 1.0));
  const Eigen::VectorXd rhs = Eigen::VectorXd::Ones(9);
  const Eigen::VectorXd x = a.solve(rhs);
  SparseCholesky b = std::move(a);
  EXPECT_EQ(b.solve(rhs), x);
}

}  // namespace
}  // namespace field_core
