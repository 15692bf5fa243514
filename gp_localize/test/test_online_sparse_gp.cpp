// The online sparse Gaussian process against dense regression (theorem 1 and its remarks).
#include <gtest/gtest.h>

#include <tuple>

#include "dense_reference.hpp"
#include "field_core/errors.hpp"
#include "field_core/random.hpp"
#include "gp_localize/online_sparse_gp.hpp"

using field_core::Kernel;
using field_core::KernelType;
using namespace gp_localize;
using gp_localize::test::block_regression;
using gp_localize::test::DenseField;

namespace {

constexpr double kNoiseVariance = 0.09;
constexpr double kJitter = 1e-6;
// Dense and online forms round differently; the support covariance here has condition 1e6, which
// leaves 1e-10. The issue asks for 1e-9.
constexpr double kTolerance = 1e-9;

struct Case {
  KernelType kernel;
  bool noisy_support;
};

class OnlineSparseGpTest : public ::testing::TestWithParam<std::tuple<KernelType, bool>> {
 protected:
  OnlineSparseGpTest()
      : kernel(std::get<0>(GetParam()), 1.3, {2.0, 1.5}),
        support(grid()),
        basis(kernel, support, kJitter, std::get<1>(GetParam()) ? kNoiseVariance : 0.0) {
    dense = {kernel, support,
             kJitter * kernel.signal_variance() + (std::get<1>(GetParam()) ? kNoiseVariance : 0.0),
             kNoiseVariance};
    field_core::Random random(7);
    x.resize(2, 37);
    z.resize(37);
    for (int i = 0; i < 37; ++i) {  // a wandering path, so that neighbours in time are correlated
      x.col(i) << 4.0 + 3.5 * std::sin(0.31 * i) + 0.1 * random.normal(),
          3.0 + 2.5 * std::sin(0.17 * i + 1.0) + 0.1 * random.normal();
      z[i] = std::sin(x(0, i)) + 0.3 * random.normal();
    }
    x.col(20) = x.col(19);  // the robot stands still: noise belongs to the datum, not to the place
  }

  static Eigen::Matrix2Xd grid() {
    Eigen::Matrix2Xd s(2, 12);
    for (int i = 0; i < 12; ++i) s.col(i) << (i % 4) * 2.5, (i / 4) * 2.5;
    return s;
  }

  OnlineSparseGp learn(int count, int slice_size, Recent recent) const {
    OnlineSparseGp gp(static_cast<int>(basis.size()), slice_size, recent);
    OnlineSparseGp::Evaluation at;
    Features phi;
    for (int i = 0; i < count; ++i) {
      basis.features(x.col(i), phi);
      gp.evaluate(basis, x.col(i), phi.data(), 1, at);
      gp.append(x.col(i), phi.data(), 1, at, z[i], kNoiseVariance);
    }
    return gp;
  }

  test::Moments predict(const OnlineSparseGp& gp, const Eigen::Vector2d& query) const {
    OnlineSparseGp::Evaluation at;
    Features phi;
    basis.features(query, phi);
    gp.evaluate(basis, query, phi.data(), 1, at);
    return {at.mean, at.variance};
  }

  static std::vector<int> blocks(int count, int slice_size) {
    std::vector<int> b(count);
    for (int i = 0; i < count; ++i) b[i] = i / slice_size;
    return b;
  }

  void expect_equal(const OnlineSparseGp& gp, int count, const std::vector<int>& block,
                    int query_block) const {
    for (const Eigen::Vector2d& query :
         {Eigen::Vector2d(1.0, 1.0), Eigen::Vector2d(7.3, 4.1), Eigen::Vector2d(x.col(count - 1)),
          Eigen::Vector2d(30.0, -20.0)}) {
      const auto expected =
          block_regression(dense, x.leftCols(count), z.head(count), block, query, query_block);
      const auto actual = predict(gp, query);
      EXPECT_NEAR(actual.mean, expected.mean, kTolerance);
      EXPECT_NEAR(actual.variance, expected.variance, kTolerance);
    }
  }

  Kernel kernel;
  Eigen::Matrix2Xd support;
  SupportBasis basis;
  DenseField dense;
  Eigen::Matrix2Xd x;
  Eigen::VectorXd z;
};

TEST_P(OnlineSparseGpTest, PriorBeforeAnyMeasurement) {
  const OnlineSparseGp gp(12, 10, Recent::used);
  const auto p = predict(gp, {1.2, 3.4});
  EXPECT_EQ(p.mean, 0.0);
  EXPECT_NEAR(p.variance, 1.3 * 1.3, 1e-12);
}

TEST_P(OnlineSparseGpTest, EqualsOfflinePitcAtSliceBoundaries) {
  for (const int slices : {1, 2, 3}) {
    const int n = 10 * slices;
    expect_equal(learn(n, 10, Recent::used), n, blocks(n, 10), -1);
    expect_equal(learn(n, 10, Recent::ignored), n, blocks(n, 10), -1);
  }
}

TEST_P(OnlineSparseGpTest, EqualsFitcAtSliceSizeOne) {
  for (const int n : {1, 5, 37}) expect_equal(learn(n, 1, Recent::used), n, blocks(n, 1), -1);
}

TEST_P(OnlineSparseGpTest, WithinASliceTheQueryBelongsToTheOpenBlock) {
  for (const int n : {1, 9, 14, 37}) {
    expect_equal(learn(n, 10, Recent::used), n, blocks(n, 10), n % 10 ? (n - 1) / 10 : -1);
  }
}

TEST_P(OnlineSparseGpTest, RecentDataIgnoredUntilTheSliceCloses) {
  for (const int n : {14, 19, 25}) {
    const int closed = n / 10 * 10;
    expect_equal(learn(n, 10, Recent::ignored), closed, blocks(closed, 10), -1);
  }
}

TEST_P(OnlineSparseGpTest, RecentDataMatter) {  // or the tests above could not tell the forms apart
  const Eigen::Vector2d query = x.col(36);
  const auto with = predict(learn(37, 10, Recent::used), query);
  const auto without = predict(learn(37, 10, Recent::ignored), query);
  EXPECT_GT(std::abs(with.mean - without.mean), 0.01);
  EXPECT_LT(with.variance, 0.9 * without.variance);
}

TEST_P(OnlineSparseGpTest, ClosingASliceEarlyMakesABlock) {
  OnlineSparseGp gp = learn(14, 10, Recent::used);
  gp.end_slice();
  expect_equal(gp, 14, blocks(14, 10), -1);
}

TEST_P(OnlineSparseGpTest, NumbersRestoreBitForBit) {
  const OnlineSparseGp gp = learn(14, 10, Recent::used);
  OnlineSparseGp copy(12, 10, Recent::used);
  copy.restore(gp.numbers().data());
  EXPECT_EQ(copy.numbers(), gp.numbers());
  EXPECT_EQ(predict(copy, {1.0, 2.0}).mean, predict(gp, {1.0, 2.0}).mean);
  EXPECT_EQ(copy.open(), 4);
}

TEST_P(OnlineSparseGpTest, StaysPositiveDefiniteOverALongRun) {
  OnlineSparseGp gp(12, 10, Recent::used);
  OnlineSparseGp::Evaluation at;
  Features phi;
  for (int i = 0; i < 20000; ++i) {
    const int k = i % 37;
    basis.features(x.col(k), phi);
    gp.evaluate(basis, x.col(k), phi.data(), 1, at);
    ASSERT_GE(at.variance, 0.0);
    gp.append(x.col(k), phi.data(), 1, at, z[k], kNoiseVariance);
  }
  Eigen::MatrixXd a(12, 12);
  const double* from = gp.covariance();
  for (int j = 0; j < 12; ++j) {
    for (int i = j; i < 12; ++i) a(i, j) = a(j, i) = *from++;
  }
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(a).eigenvalues().minCoeff(), 0.0);
}

INSTANTIATE_TEST_SUITE_P(KernelsAndSupports, OnlineSparseGpTest,
                         ::testing::Combine(::testing::Values(KernelType::squared_exponential,
                                                              KernelType::matern32,
                                                              KernelType::matern52),
                                            ::testing::Bool()));

TEST(SupportBasisTest, WhitenedFeaturesGiveGamma) {
  const Kernel kernel(KernelType::squared_exponential, 2.0, {1.0, 3.0});
  Eigen::Matrix2Xd s(2, 3);
  s << 0, 1, 0.5, 0, 0.3, 2;
  const SupportBasis basis(kernel, s, 0.0, 0.0);
  Eigen::Matrix2Xd x(2, 11);  // more than one block of lanes, and a remainder
  for (int i = 0; i < 11; ++i) x.col(i) << 0.3 * i - 1.0, 0.2 * i;
  Features phi;
  basis.features(x, phi);
  const Eigen::MatrixXd expected = test::gamma({kernel, s, 0.0, 0.0}, x, x);
  EXPECT_LT((phi.transpose() * phi - expected).cwiseAbs().maxCoeff(), 1e-11);
}

TEST(SupportBasisTest, NamesCoincidentPoints) {
  const Kernel kernel(KernelType::squared_exponential, 2.0, {1.0, 3.0});
  Eigen::Matrix2Xd s(2, 3);
  s << 0, 1, 0, 0, 0.3, 0;
  try {
    SupportBasis(kernel, s, 1e-8, 0.0);
    FAIL() << "two equal support points were accepted";
  } catch (const field_core::NumericalError& error) {
    EXPECT_NE(std::string(error.what()).find("support points 0"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("and 2"), std::string::npos);
  }
}

TEST(SupportBasisTest, SingularCovarianceNamesTheRemedy) {
  const Kernel kernel(KernelType::squared_exponential, 2.0, {100.0, 100.0});
  Eigen::Matrix2Xd s(2, 30);
  for (int i = 0; i < 30; ++i) s.col(i) << 0.1 * i, 0.0;
  try {
    SupportBasis(kernel, s, 0.0, 0.0);
    FAIL() << "a singular support covariance was accepted";
  } catch (const field_core::NumericalError& error) {
    EXPECT_NE(std::string(error.what()).find("jitter"), std::string::npos);
  }
}

}  // namespace
