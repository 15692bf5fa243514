// Places of more coordinates than the plane has: every observation model and the likelihood against
// plain dense regression with a kernel written out here.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "../src/path_panels.hpp"
#include "field_core/errors.hpp"
#include "field_core/random.hpp"
#include "gp_localize/dense_gp.hpp"
#include "gp_localize/hyperparameter_learning.hpp"
#include "gp_localize/online_sparse_gp.hpp"
#include "gp_localize/support_set.hpp"

using namespace gp_localize;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using field_core::Kernel;
using field_core::KernelType;

namespace {

constexpr double kSignal = 1.4, kNoise = 0.3, kJitter = 1e-6;
constexpr int kCount = 23;

/// Squared exponential in every number of dimensions, by its definition.
MatrixXd covariance(const MatrixXd& a, const MatrixXd& b, const VectorXd& lengths) {
  MatrixXd k(a.cols(), b.cols());
  for (Eigen::Index i = 0; i < a.cols(); ++i) {
    for (Eigen::Index j = 0; j < b.cols(); ++j) {
      double r2 = 0.0;
      for (Eigen::Index axis = 0; axis < a.rows(); ++axis) {
        r2 += std::pow((a(axis, i) - b(axis, j)) / lengths[axis], 2);
      }
      k(i, j) = kSignal * kSignal * std::exp(-0.5 * r2);
    }
  }
  return k;
}

class InDimensions : public ::testing::TestWithParam<int> {
 protected:
  InDimensions() : random(11) {
    const int d = GetParam();
    lengths = VectorXd::LinSpaced(d, 0.8, 2.0);
    x = draw(d, kCount);
    queries = draw(d, 9);
    support = draw(d, 14);
    z.resize(kCount);
    for (double& value : z) value = random.normal();
    x.col(5) = x.col(4);
  }
  MatrixXd draw(int d, int n) {
    MatrixXd places(d, n);
    for (double& value : places.reshaped()) value = random.uniform(0.0, 2.0);
    return places;
  }
  Kernel kernel() const { return {KernelType::squared_exponential, kSignal, lengths}; }
  SupportBasis basis() const { return {kernel(), support, kJitter, 0.0}; }

  /// Mean and variance at the queries if `cov` is the covariance of the measurements.
  Eigen::Matrix2Xd regress(MatrixXd cov, const MatrixXd& cross, const VectorXd& values) const {
    cov.diagonal().array() += kNoise * kNoise;
    const MatrixXd solved = cov.ldlt().solve(cross);
    Eigen::Matrix2Xd moments(2, cross.cols());
    moments.row(0) = values.transpose() * solved;
    moments.row(1) = kSignal * kSignal - (cross.cwiseProduct(solved)).colwise().sum().array();
    return moments;
  }
  MatrixXd gamma(const MatrixXd& a, const MatrixXd& b) const {
    MatrixXd ss = covariance(support, support, lengths);
    ss.diagonal().array() += kJitter * kSignal * kSignal;
    return covariance(a, support, lengths) * ss.ldlt().solve(covariance(support, b, lengths));
  }
  /// PITC in slices, the queries in the last one, which is open.
  Eigen::Matrix2Xd open_slice_regression(int slice) const {
    const int last = kCount / slice;
    MatrixXd cov = gamma(x, x), cross = gamma(x, queries);
    const MatrixXd exact = covariance(x, x, lengths), seen = covariance(x, queries, lengths);
    for (int i = 0; i < kCount; ++i) {
      for (int j = 0; j < kCount; ++j) {
        if (i / slice == j / slice) cov(i, j) = exact(i, j);
      }
      if (i / slice == last) cross.row(i) = seen.row(i);
    }
    return regress(cov, cross, z);
  }

  field_core::Random random;
  VectorXd lengths, z;
  MatrixXd x, queries, support;
};
INSTANTIATE_TEST_SUITE_P(D, InDimensions, ::testing::Values(1, 2, 3, 6, 12));

TEST_P(InDimensions, SubsetsOfDataAreDenseRegression) {
  DenseGp all(ObservationModelType::full_gp, 0), recent(ObservationModelType::sod_truncate, 8);
  for (int i = 0; i < kCount; ++i) {
    for (DenseGp* gp : {&all, &recent}) gp->append(kernel(), x.col(i), z[i], kNoise * kNoise);
  }
  Eigen::Matrix2Xd moments;
  all.predict(kernel(), queries, moments);
  const auto expected = regress(covariance(x, x, lengths), covariance(x, queries, lengths), z);
  EXPECT_LT((moments - expected).cwiseAbs().maxCoeff(), 1e-11);
  recent.predict(kernel(), queries, moments);
  const MatrixXd tail = x.rightCols(8);
  const auto truncated =
      regress(covariance(tail, tail, lengths), covariance(tail, queries, lengths), z.tail(8));
  EXPECT_LT((moments - truncated).cwiseAbs().maxCoeff(), 1e-11);
}

TEST_P(InDimensions, OnlinePitcIsDensePitcWithTheQueryInTheOpenSlice) {
  constexpr int kSlice = 5;
  OnlineSparseGp gp(14, kSlice, Recent::used, GetParam());
  Evaluation at;
  Features phi;
  for (int i = 0; i < kCount; ++i) {
    basis().features(x.col(i), phi);
    gp.evaluate(basis(), x.col(i), phi.data(), 1, at);
    gp.append(x.col(i), phi.data(), 1, at, z[i], kNoise * kNoise);
  }
  EXPECT_EQ(Place(gp.open_point(0)), Place(x.col(20)));
  OnlineSparseGp restored(14, kSlice, Recent::used, GetParam());
  const auto numbers = gp.numbers();
  ASSERT_EQ(numbers.size(), OnlineSparseGp::number_count(14, kSlice, GetParam()));
  restored.restore(numbers.data());
  const auto expected = open_slice_regression(kSlice);
  for (Eigen::Index q = 0; q < queries.cols(); ++q) {
    basis().features(queries.col(q), phi);
    for (const OnlineSparseGp* map : {&gp, &restored}) {
      map->evaluate(basis(), queries.col(q), phi.data(), 1, at);
      EXPECT_NEAR(at.mean, expected(0, q), 1e-9);
      EXPECT_NEAR(at.variance, expected(1, q), 1e-9);
    }
  }
}

/// The same with all paths side by side; one path is enough to see that coordinates arrive.
TEST_P(InDimensions, PanelsAgreeInBothPrecisions) {
  constexpr int kSlice = 5;
  const SupportBasis b = basis();
  const auto expected = open_slice_regression(kSlice);
  for (const Precision precision : {Precision::double_precision, Precision::single_precision}) {
    const auto panels = make_path_panels(b, 1, kSlice, Recent::used, precision, 1e-2);
    OnlineSparseGp gp(14, kSlice, Recent::used, GetParam());
    Evaluation at;
    Features phi;
    MatrixXd summary(OnlineSparseGp::summary_size(14), 1);
    for (int i = 0; i < kCount; ++i) {
      if (gp.open() == 0) {
        summary.col(0) = Eigen::Map<const VectorXd>(gp.summary(), summary.rows());
        panels->assimilate(summary);
      }
      b.features(x.col(i), phi);
      panels->extend(b, x.col(i), phi, z[i], kNoise * kNoise);
      gp.evaluate(b, x.col(i), phi.data(), 1, at);
      gp.append(x.col(i), phi.data(), 1, at, z[i], kNoise * kNoise);
    }
    Eigen::Matrix2Xd moments;
    panels->add(b, queries, 0.0, 0.0, nullptr, moments);
    moments.row(1) -= moments.row(0).cwiseAbs2();
    const bool exact = precision == Precision::double_precision;
    EXPECT_LT((moments - expected).cwiseAbs().maxCoeff(), exact ? 1e-9 : 1e-4);
  }
}

TEST_P(InDimensions, LikelihoodsHaveTheRightValueAndGradient) {
  FieldSurvey survey{x, z};
  const Hyperparameters h{0.2, kSignal, kNoise, lengths};
  MatrixXd sigma = covariance(x, x, lengths);
  sigma.diagonal().array() += kNoise * kNoise;
  const VectorXd error = z.array() - 0.2;
  const double expected = -0.5 * (error.dot(sigma.ldlt().solve(error)) +
                                  std::log(sigma.determinant()) + kCount * std::log(2 * M_PI));
  const FullLikelihood full(KernelType::squared_exponential, survey);
  EXPECT_NEAR(full(to_theta(h), nullptr), expected, 1e-8);
  // A jitter that leaves differences their digits where 14 support points crowd one axis.
  const PitcLikelihood pitc(KernelType::squared_exponential, survey, support, 6, 1e-3);
  for (const MarginalLikelihood* likelihood : {static_cast<const MarginalLikelihood*>(&full),
                                               static_cast<const MarginalLikelihood*>(&pitc)}) {
    Theta gradient;
    (*likelihood)(to_theta(h), &gradient);
    ASSERT_EQ(gradient.size(), 3 + GetParam());
    for (Eigen::Index i = 0; i < gradient.size(); ++i) {
      constexpr double kStep = 1e-5;
      Theta above = to_theta(h), below = above;
      above[i] += kStep;
      below[i] -= kStep;
      const double slope =
          ((*likelihood)(above, nullptr) - (*likelihood)(below, nullptr)) / (2.0 * kStep);
      EXPECT_NEAR(gradient[i], slope, 1e-5 * (1.0 + std::abs(slope))) << "theta " << i;
    }
  }
}

TEST(Places, HyperparametersOfThreeCoordinatesAreFound) {
  field_core::Random random(3);
  const VectorXd lengths = Eigen::Vector3d(0.7, 1.5, 1.0);
  FieldSurvey survey{Places(3, 300), VectorXd(300)};
  for (double& value : survey.places.reshaped()) value = random.uniform(0.0, 4.0);
  VectorXd white(300);
  for (double& value : white) value = random.normal();
  MatrixXd sigma = covariance(survey.places, survey.places, lengths);
  sigma.diagonal().array() += kNoise * kNoise;
  survey.values = (sigma.llt().matrixL() * white).array() + 5.0;
  LearningOptions options;
  options.starts = 2;
  const LearnedField found = learn_hyperparameters(survey, options);
  for (int axis = 0; axis < 3; ++axis) {  // within three of its own standard errors
    EXPECT_NEAR(found.value.length_scales[axis], lengths[axis],
                3.0 * found.standard_error.length_scales[axis]);
    EXPECT_LT(found.standard_error.length_scales[axis], 0.3 * lengths[axis]);
  }
  EXPECT_NEAR(found.value.signal_stddev, kSignal, 3.0 * found.standard_error.signal_stddev);
}

TEST(Places, SupportIsChosenAmongPlacesOfAnyDimension) {
  Places corners(4, 16);
  for (int i = 0; i < 16; ++i) {
    for (int axis = 0; axis < 4; ++axis) corners(axis, i) = i >> axis & 1;
  }
  const Kernel kernel(KernelType::matern32, 1.0, Eigen::Vector4d(1.0, 2.0, 3.0, 4.0));
  for (const Places& chosen :
       {spread_over(corners, corners.col(0), 5), most_informative(corners, 5, kernel, 0.01)}) {
    ASSERT_EQ(chosen.rows(), 4);
    ASSERT_EQ(chosen.cols(), 5);
    for (int i = 0; i < 5; ++i) {
      for (int j = 0; j < i; ++j) EXPECT_GT((chosen.col(i) - chosen.col(j)).norm(), 0.5);
    }
  }
}

TEST(Places, WrongNumbersOfCoordinatesAreSaid) {
  EXPECT_THROW(Kernel(KernelType::matern32, 1.0, VectorXd(0)), field_core::ParameterError);
  EXPECT_THROW(Kernel(KernelType::matern32, 1.0, VectorXd(VectorXd::Ones(13))),
               field_core::ParameterError);
  const Kernel kernel(KernelType::matern32, 1.0, VectorXd(VectorXd::Ones(3)));
  EXPECT_THROW(SupportBasis(kernel, Places::Random(2, 4), 1e-6, 0.0), field_core::NumericalError);
}

}  // namespace
