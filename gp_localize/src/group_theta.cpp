#include "gp_localize/group_theta.hpp"

#include <cmath>

namespace gp_localize {

using Eigen::Index;
using Eigen::MatrixXd;

GroupTheta::GroupTheta(const Theta& theta, int fields) : theta_(theta), fields_(fields) {
  factor_ = MatrixXd::Zero(fields, fields);
  for (int a = 0; a < fields; ++a) {
    double left = 1.0;
    for (int b = 0; b < a; ++b) {
      factor_(a, b) = partial(a, b) * left;
      left *= std::sqrt(1.0 - partial(a, b) * partial(a, b));
    }
    factor_(a, a) = left;
  }
  correlation_ = factor_ * factor_.transpose();
  correlation_.diagonal().setOnes();
  covariance_.resize(fields, fields);
  for (int a = 0; a < fields; ++a) {
    for (int b = 0; b < fields; ++b) {
      covariance_(a, b) = signal_stddev(a) * signal_stddev(b) * correlation_(a, b);
    }
  }
}

field_core::Place GroupTheta::length_scales() const {
  return theta_.tail(theta_.size() - lengths_at()).unaryExpr([](double log) {
    return std::exp(log);
  });
}

void GroupTheta::add_gradient(const MatrixXd& slope, Theta& gradient) const {
  const MatrixXd both = slope + slope.transpose();
  for (int a = 0; a < fields_; ++a) {
    gradient[signal_at(a)] += both.row(a).dot(covariance_.row(a));
  }
  MatrixXd by_correlation = both;
  for (int a = 0; a < fields_; ++a) {
    for (int b = 0; b < fields_; ++b) by_correlation(a, b) *= signal_stddev(a) * signal_stddev(b);
  }
  const MatrixXd by_factor = by_correlation * factor_;
  for (int a = 0; a < fields_; ++a) {
    for (int b = 0; b < a; ++b) {  // c_ab is in L_ab, and in every L_aj after it
      const double c = partial(a, b), rest = 1.0 - c * c;
      double left = 1.0;
      for (int k = 0; k < b; ++k) left *= std::sqrt(1.0 - partial(a, k) * partial(a, k));
      double sum = by_factor(a, b) * left;
      for (int j = b + 1; j <= a; ++j) sum -= by_factor(a, j) * factor_(a, j) * c / rest;
      gradient[partial_at(a, b)] += sum;
    }
  }
}

}  // namespace gp_localize
