#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "field_core/errors.hpp"
#include "field_core/kernels.hpp"
#include "field_core/random.hpp"
#include "support.hpp"

namespace field_core {
namespace {

// Decimals computed by hand from Rasmussen and Williams (2006), eq. (4.9) and (4.17), r = 1:
//   exp(-1/2); (1 + sqrt 3) exp(-sqrt 3); (1 + sqrt 5 + 5/3) exp(-sqrt 5)
TEST(Kernels, ValuesAtUnitDistance) {
  const Eigen::Vector2d a(0.0, 0.0), b(1.0, 0.0), ones(1.0, 1.0);
  EXPECT_NEAR(Kernel(KernelType::squared_exponential, 1.0, ones)(a, b), 0.6065306597126334, 1e-15);
  EXPECT_NEAR(Kernel(KernelType::matern32, 1.0, ones)(a, b), 0.4833577245965077, 1e-15);
  EXPECT_NEAR(Kernel(KernelType::matern52, 1.0, ones)(a, b), 0.5239941088318203, 1e-15);
}

// Matern with half-integer smoothness is a Bessel function of the second kind (eq. 4.14), which the
// standard library computes on its own.
TEST(Kernels, MaternAgreesWithTheBesselForm) {
  for (const auto& [type, nu] :
       {std::pair(KernelType::matern32, 1.5), {KernelType::matern52, 2.5}}) {
    for (double r = 0.05; r < 6.0; r += 0.31) {
      const double z = std::sqrt(2.0 * nu) * r;
      const double expected =
          std::pow(2.0, 1.0 - nu) / std::tgamma(nu) * std::pow(z, nu) * std::cyl_bessel_k(nu, z);
      EXPECT_NEAR(correlation(type, r * r), expected, 1e-12) << "nu " << nu << ", r " << r;
    }
  }
}

TEST(Kernels, SlopesAgreeWithDifferences) {
  for (const auto type :
       {KernelType::squared_exponential, KernelType::matern32, KernelType::matern52}) {
    for (const double r2 : {0.02, 0.5, 3.0, 20.0}) {
      const double step = 1e-5 * r2;
      const double difference =
          (correlation(type, r2 + step) - correlation(type, r2 - step)) / (2.0 * step);
      EXPECT_NEAR(correlation_slope(type, r2), difference, 1e-8);
    }
  }
}

TEST(Kernels, LengthScalesActPerAxisAndSignalScalesAll) {
  const Kernel kernel(KernelType::squared_exponential, 3.0, {2.0, 0.5});
  EXPECT_DOUBLE_EQ(kernel.signal_variance(), 9.0);
  EXPECT_DOUBLE_EQ(kernel({1, 1}, {1, 1}), 9.0);  // no measurement noise in it
  // (2 / 2)^2 + (0.5 / 0.5)^2 = 2, and the 1/2 is inside the exponent.
  EXPECT_NEAR(kernel({0, 0}, {2, 0.5}), 9.0 * std::exp(-1.0), 1e-14);
  EXPECT_NEAR(kernel({0, 0}, {2, 0.0}), 9.0 * std::exp(-0.5), 1e-14);
}

TEST(Kernels, GramMatricesAreSymmetricPositiveDefinite) {
  Random random(7);
  Eigen::Matrix2Xd points(2, 40);
  for (Eigen::Index i = 0; i < points.size(); ++i) points(i) = random.uniform(0.0, 40.0);
  for (const auto type :
       {KernelType::squared_exponential, KernelType::matern32, KernelType::matern52}) {
    const Kernel kernel(type, 1.5, {3.0, 5.0});
    const Eigen::MatrixXd gram = kernel.matrix(points, points);
    EXPECT_EQ(gram, gram.transpose().eval());
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(gram).eigenvalues().minCoeff(), 0.0);
    EXPECT_EQ(kernel.matrix(points.leftCols(3), points)(2, 17),
              kernel(points.col(2), points.col(17)));
  }
}

TEST(Kernels, NumbersThatAreNotPositiveAreRefusedByKey) {
  const auto make = [](double signal, double x, double y) {
    return [=] { Kernel(KernelType::matern32, signal, {x, y}); };
  };
  test::expect_error<ParameterError>(make(0.0, 1, 1), {"signal_stddev", "positive"});
  test::expect_error<ParameterError>(make(1.0, -1, 1), {"length_scales", "-1"});
  test::expect_error<ParameterError>(make(1.0, 1, std::nan("")), {"length_scales", "nan"});
}

}  // namespace
}  // namespace field_core
