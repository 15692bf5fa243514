// The fast kernels against plain loops over full matrices, for sizes with and without remainders
// and for both instruction sets.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <vector>

#include "../src/instruction_sets.hpp"
#include "../src/packed_symmetric.hpp"
#include "field_core/random.hpp"

using namespace gp_localize;
using field_core::KernelType;

namespace {

class PackedSymmetric : public ::testing::TestWithParam<std::tuple<int, bool>> {
 protected:
  PackedSymmetric() : n(std::get<0>(GetParam())), random(n) {
    use_wide_vectors(std::get<1>(GetParam()));
    full.resize(n, n);
    for (int j = 0; j < n; ++j) {
      for (int i = j; i < n; ++i) full(i, j) = full(j, i) = random.normal();
    }
  }
  ~PackedSymmetric() override { use_wide_vectors(true); }

  std::vector<double> pack(const Eigen::MatrixXd& a) const {
    std::vector<double> packed;
    for (int j = 0; j < n; ++j) {
      for (int i = j; i < n; ++i) packed.push_back(a(i, j));
    }
    return packed;
  }
  Eigen::MatrixXd normal(int rows, int columns) {
    Eigen::MatrixXd m(rows, columns);
    for (Eigen::Index i = 0; i < m.size(); ++i) m(i) = random.normal();
    return m;
  }

  int n;
  field_core::Random random;
  Eigen::MatrixXd full;
};

// Sums of at most 43 products near 1: rounding stays below 1e-13.
TEST_P(PackedSymmetric, Multiplies) {
  const Eigen::VectorXd x = normal(n, 1);
  Eigen::VectorXd y = Eigen::VectorXd::Constant(n, 7.0);  // is overwritten
  packed_multiply(pack(full).data(), n, x.data(), y.data());
  EXPECT_LT((y - full * x).cwiseAbs().maxCoeff(), 1e-13);
  EXPECT_NEAR(dot_product(x.data(), y.data(), n), x.dot(full * x), 1e-12);
}

TEST_P(PackedSymmetric, Downdates) {
  for (const int count : {0, 1, 3}) {
    const Eigen::MatrixXd g = normal(n, count);
    const std::vector<double> from = pack(full);
    std::vector<double> to(from.size());
    packed_downdate(from.data(), n, count, g.data(), to.data());
    std::vector<double> in_place = from;
    packed_downdate(in_place.data(), n, count, g.data(), in_place.data());
    EXPECT_EQ(to, in_place);
    const std::vector<double> expected = pack(full - g * g.transpose());
    for (std::size_t i = 0; i < to.size(); ++i) EXPECT_NEAR(to[i], expected[i], 1e-13);
  }
}

TEST_P(PackedSymmetric, CovariancesOfOpenRows) {
  const Eigen::VectorXd phi = normal(n, 1);
  for (const int count : {0, 1, 4, 7}) {
    const Eigen::MatrixXd gain = normal(n, count);
    for (const int dimensions : {1, 2, 5, field_core::kMostDimensions}) {
      Eigen::MatrixXd places = Eigen::MatrixXd::Zero(8, dimensions);
      places.topRows(count) = normal(count, dimensions);
      const Eigen::VectorXd at = normal(dimensions, 1);
      const Eigen::VectorXd lengths = normal(dimensions, 1).cwiseAbs().array() + 0.3;
      for (const auto type :
           {KernelType::squared_exponential, KernelType::matern32, KernelType::matern52}) {
        const field_core::Kernel kernel(type, 1.3, lengths);
        double prior[8], out[8];
        std::fill(prior, prior + 8, kernel.signal_variance());
        open_covariances(
            {type, prior, dimensions, lengths.data(), n, count, 8, places.data(), gain.data()},
            at.data(), phi.data(), out);
        for (int i = 0; i < count; ++i) {
          const double expected = kernel(places.row(i).transpose(), at) - gain.col(i).dot(phi);
          EXPECT_NEAR(out[i], expected, 1e-13);
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, PackedSymmetric,
                         ::testing::Combine(::testing::Values(1, 3, 4, 8, 11, 40, 43),
                                            ::testing::Bool()));

}  // namespace
