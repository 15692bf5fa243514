#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "field_core/errors.hpp"
#include "field_core/random.hpp"
#include "support.hpp"

namespace field_core {
namespace {

// Computed by a separate Python implementation of MT19937-64 that reproduces the standard's 10000th
// number (9981545732273789042 from seed 5489), and of the polar method.
TEST(Random, FirstNumbersAreTheSameOnEveryPlatform) {
  Random uniform(42), normal(42);
  for (const double expected :
       {0x1.82a3befaddcbcp-1, 0x1.472f1f73724a0p-1, 0x1.81192cfe1cbcfp-1, 0x1.171621fc50d68p-3}) {
    EXPECT_EQ(uniform.uniform(), expected);
  }
  for (const double expected :
       {1.2938204232729367, 0.7049882664208599, 0.3979773961837887, -0.5740948067202614}) {
    EXPECT_NEAR(normal.normal(), expected, 1e-15);  // log and sqrt may differ in the last bit
  }
}

// Bounds are 4.5 standard errors of the sample moments: one false alarm in 10^5 for another seed.
TEST(Random, MomentsOfUniformAndNormal) {
  constexpr int n = 200000;
  Random random(11);
  double u1 = 0, u2 = 0, z1 = 0, z2 = 0, z3 = 0, z4 = 0;
  for (int k = 0; k < n; ++k) {
    const double u = random.uniform(), z = random.normal();
    u1 += u / n, u2 += u * u / n;
    z1 += z / n, z2 += z * z / n, z3 += z * z * z / n, z4 += z * z * z * z / n;
  }
  const double bound = 4.5 / std::sqrt(n);
  EXPECT_NEAR(u1, 0.5, bound * std::sqrt(1.0 / 12.0));
  EXPECT_NEAR(u2, 1.0 / 3.0, bound * std::sqrt(4.0 / 45.0));  // var(u^2) = 1/5 - 1/9
  EXPECT_NEAR(z1, 0.0, bound);
  EXPECT_NEAR(z2, 1.0, bound * std::sqrt(2.0));
  EXPECT_NEAR(z3, 0.0, bound * std::sqrt(15.0));
  EXPECT_NEAR(z4, 3.0, bound * std::sqrt(96.0));  // E z^8 - 9 = 105 - 9
}

// Chi-square of 100 equally likely cells: 99 degrees of freedom, two-sided 1e-4 quantiles of
// N(99, 198) about; too even is as suspicious as too uneven.
TEST(Random, CellsAreEquallyLikely) {
  constexpr int n = 100000, cells = 100;
  Random random(12);
  std::array<int, cells> uniform{}, normal{}, index{};
  for (int k = 0; k < n; ++k) {
    ++uniform[static_cast<std::size_t>(random.uniform() * cells)];
    const double share = 0.5 * std::erfc(-random.normal() / std::sqrt(2.0));
    ++normal[std::min<std::size_t>(static_cast<std::size_t>(share * cells), cells - 1)];
    ++index[random.index(cells)];
  }
  for (const auto& counts : {uniform, normal, index}) {
    double chi2 = 0.0;
    for (const int count : counts) chi2 += std::pow(count - n / cells, 2) / (n / cells);
    EXPECT_GT(chi2, 99.0 - 3.7 * std::sqrt(198.0));
    EXPECT_LT(chi2, 99.0 + 3.9 * std::sqrt(198.0) + 6.0);  // skewed to the right
  }
}

// Share of |t| beyond the 95 % points of Student's table, within 4.5 standard errors.
TEST(Random, StudentTHasTheTailsOfTheTable) {
  constexpr int n = 100000;
  for (const auto& [degrees, point] : {std::pair(3.0, 3.182446), {10.0, 2.228139}}) {
    Random random(13);
    int outside = 0;
    for (int k = 0; k < n; ++k) outside += std::abs(random.student_t(degrees)) > point;
    EXPECT_NEAR(outside / double(n), 0.05, 4.5 * std::sqrt(0.05 * 0.95 / n)) << degrees;
  }
}

TEST(Random, Normal3HasTheCovariance) {
  constexpr int n = 100000;
  Eigen::Matrix3d covariance;
  covariance << 4.0, 1.0, -0.5, 1.0, 2.0, 0.3, -0.5, 0.3, 0.25;
  Random random(14);
  Eigen::Matrix3d sample = Eigen::Matrix3d::Zero();
  for (int k = 0; k < n; ++k) {
    const Eigen::Vector3d draw = random.normal3(covariance);
    sample += draw * draw.transpose() / n;
  }
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {  // var of a product of Gaussians: c_ii c_jj + c_ij^2
      const double variance =
          covariance(i, i) * covariance(j, j) + covariance(i, j) * covariance(i, j);
      EXPECT_NEAR(sample(i, j), covariance(i, j), 4.5 * std::sqrt(variance / n)) << i << j;
    }
  }
}

TEST(Random, Normal3StaysInTheRangeOfASingularCovariance) {
  Random random(15);
  EXPECT_EQ(random.normal3(Eigen::Matrix3d::Zero()), Eigen::Vector3d::Zero());
  const Eigen::Vector3d direction(1.0, -2.0, 0.5);
  for (int k = 0; k < 100; ++k) {
    const Eigen::Vector3d draw = random.normal3(direction * direction.transpose());
    EXPECT_NEAR(draw.cross(direction).norm(), 0.0, 1e-6);  // square root of rounding in the pivots
  }
  EXPECT_NE(random.normal3(direction * direction.transpose()), Eigen::Vector3d::Zero());
}

TEST(Random, RestoreContinuesBitForBit) {
  Random original(16);
  for (int k = 0; k < 501; ++k) original.normal();  // odd: a spare value is kept
  Random copy(999);
  copy.restore(original.state());
  for (int k = 0; k < 1000; ++k) {
    EXPECT_EQ(original.normal(), copy.normal());
    EXPECT_EQ(original.uniform(), copy.uniform());
  }
}

TEST(Random, DamagedStateIsRefusedAndChangesNothing) {
  Random random(17), reference(17);
  const std::string state = random.state();
  for (const std::string& damaged : {std::string(), std::string("1 2 3"), state.substr(0, 300)}) {
    test::expect_error<DataError>([&] { random.restore(damaged); }, {"random"});
  }
  EXPECT_EQ(random.uniform(), reference.uniform());
}

TEST(Random, SeedsDiffer) { EXPECT_NE(Random(1).uniform(), Random(2).uniform()); }

}  // namespace
}  // namespace field_core
