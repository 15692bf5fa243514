// Corners of an inverse against the dense inverse, by every version of the kernel.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "corner_inverse.hpp"
#include "field_core/random.hpp"

using namespace field_core;
using Eigen::MatrixXd;

namespace {

/// A lower factor with `share` of its entries, as compressed columns.
struct Factor {
  Factor(int n, double share, Random& random) : dense(MatrixXd::Zero(n, n)) {
    start.push_back(0);
    for (int j = 0; j < n; ++j) {
      for (int i = j; i < n; ++i) {
        if (i > j && random.uniform() > share) continue;
        dense(i, j) = i == j ? random.uniform(1.0, 2.0) : random.normal(0.0, 0.3 / std::sqrt(n));
        row.push_back(i);
        value.push_back(dense(i, j));
      }
      start.push_back(static_cast<int>(row.size()));
    }
  }
  FactorColumns columns() const {
    return {static_cast<int>(dense.cols()), start.data(), row.data(), value.data()};
  }
  MatrixXd dense;
  std::vector<int> start, row;
  std::vector<double> value;
};

TEST(CornerInverse, IsTheCornerOfTheDenseInverse) {
  Random random(3);
  for (const VectorWidth width : {VectorWidth::narrow, VectorWidth::avx2, VectorWidth::avx512}) {
    for (const int n : {1, 8, 31, 33, 70, 131}) {
      for (const double share : {0.0, 0.1, 1.0}) {
        const Factor factor(n, share, random);
        const MatrixXd inverse = (factor.dense * factor.dense.transpose()).inverse();
        for (const int first : {0, n / 3}) {
          const MatrixXd corner = corner_inverse(factor.columns(), first, panel_product(width));
          ASSERT_EQ(corner.rows(), n - first);
          EXPECT_EQ(corner, corner.transpose());
          // Condition below 10: both are good to some 1e-14.
          const int kept = n - first;
          EXPECT_LT((corner - inverse.bottomRightCorner(kept, kept)).cwiseAbs().maxCoeff(), 1e-12)
              << n << " " << share << " " << first;
        }
      }
    }
  }
}

}  // namespace
