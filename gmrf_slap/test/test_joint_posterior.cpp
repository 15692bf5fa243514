#include <gtest/gtest.h>

#include "dense_reference.hpp"
#include "field_core/errors.hpp"
#include "joint_posterior.hpp"

using namespace gmrf_slap;

namespace {

TEST(JointPosterior, EqualsTheFullTable) {
  // Three places, two fields with two and three hypotheses: the whole table has 18 entries.
  field_core::Random random(2);
  JointPosterior joint;
  joint.weights = Eigen::Vector3d(0.2, 0.5, 0.3);
  joint.fields.resize(2);
  joint.fields[0].probability = Eigen::Vector2d(0.3, 0.7);
  joint.fields[1].probability = Eigen::Vector3d(0.1, 0.1, 0.8);
  for (auto& field : joint.fields) {
    field.log_density = Eigen::MatrixXd::NullaryExpr(field.probability.size(), 3,
                                                     [&] { return random.normal(-700.0, 2.0); });
  }
  const JointPosterior prior = joint;
  joint.compute();
  double total = 0.0;
  Eigen::Vector3d places = Eigen::Vector3d::Zero();
  Eigen::MatrixXd first = Eigen::MatrixXd::Zero(2, 3), second = Eigen::MatrixXd::Zero(3, 3);
  for (int k = 0; k < 3; ++k) {
    for (int a = 0; a < 2; ++a) {
      for (int b = 0; b < 3; ++b) {
        const double p = prior.weights[k] * prior.fields[0].probability[a] *
                         prior.fields[1].probability[b] *
                         std::exp(prior.fields[0].log_density(a, k) +
                                  prior.fields[1].log_density(b, k) + 1400.0);
        total += p;
        places[k] += p;
        first(a, k) += p;
        second(b, k) += p;
      }
    }
  }
  EXPECT_LT((joint.weights - places / total).norm(), 1e-12);
  EXPECT_LT((joint.fields[0].probability - first.rowwise().sum() / total).norm(), 1e-12);
  EXPECT_LT((joint.fields[1].probability - second.rowwise().sum() / total).norm(), 1e-12);
  for (int a = 0; a < 2; ++a) {
    EXPECT_LT((joint.fields[0].share.row(a) - first.row(a) / first.row(a).sum()).norm(), 1e-12);
  }
}

TEST(JointPosterior, SaysWhenNoPlaceExplainsTheMeasurement) {
  JointPosterior joint;
  joint.weights = Eigen::Vector2d(0.5, 0.5);
  joint.fields.resize(1);
  joint.fields[0].probability = Eigen::VectorXd::Ones(1);
  joint.fields[0].log_density = Eigen::MatrixXd::Constant(1, 2, -HUGE_VAL);
  EXPECT_THROW(joint.compute(), field_core::NumericalError);
}

}  // namespace
