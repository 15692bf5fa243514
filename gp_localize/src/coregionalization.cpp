#include "gp_localize/coregionalization.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "field_core/errors.hpp"

namespace gp_localize {

Coregionalization::Coregionalization(const Eigen::MatrixXd& covariance) : covariance_(covariance) {
  const Eigen::LLT<Eigen::MatrixXd> factor(covariance);
  if (factor.info() != Eigen::Success || !covariance.isApprox(covariance.transpose())) {
    throw field_core::NumericalError(
        "the covariance between the fields is not symmetric positive definite; make their "
        "correlations smaller");
  }
  factor_ = factor.matrixL();
}

Eigen::MatrixXd correlation_matrix(int fields, const std::vector<double>& upper_triangle) {
  Eigen::MatrixXd r = Eigen::MatrixXd::Identity(fields, fields);
  auto next = upper_triangle.begin();
  for (int a = 0; a < fields; ++a) {
    for (int b = a + 1; b < fields; ++b) r(a, b) = r(b, a) = *next++;
  }
  return r;
}

int impossible_field(const Eigen::MatrixXd& correlation) {
  constexpr double kLeast = 1e-9;  // of a field's variance that the others do not explain
  const Eigen::Index q = correlation.rows();
  Eigen::MatrixXd l = Eigen::MatrixXd::Zero(q, q);
  for (Eigen::Index a = 0; a < q; ++a) {
    for (Eigen::Index b = 0; b < a; ++b) {
      l(a, b) = (correlation(a, b) - l.row(a).head(b).dot(l.row(b).head(b))) / l(b, b);
    }
    const double left = correlation(a, a) - l.row(a).head(a).squaredNorm();
    if (!(left > kLeast)) return static_cast<int>(a);
    l(a, a) = std::sqrt(left);
  }
  return -1;
}

}  // namespace gp_localize
