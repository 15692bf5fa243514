#include "field_ros/ellipsoid_fit.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <string>

#include "field_core/errors.hpp"

namespace field_ros {
namespace {

// Beyond this the readings hardly tell one direction from another.
constexpr double kWorstCondition = 1e4;

[[noreturn]] void fail(const std::string& what) {
  throw field_core::NumericalError("the readings do not determine the iron of the magnetometer: " +
                                   what);
}

// Rows: the monomials of a quadric in D dimensions, squares, then products, then linear.
template <int D>
Eigen::MatrixXd monomials(const Eigen::MatrixXd& p) {
  Eigen::MatrixXd rows(p.cols(), D * (D + 1) / 2 + D);
  for (Eigen::Index i = 0; i < p.cols(); ++i) {
    Eigen::Index k = 0;
    for (int a = 0; a < D; ++a) rows(i, k++) = p(a, i) * p(a, i);
    for (int a = 0; a < D; ++a) {
      for (int b = a + 1; b < D; ++b) rows(i, k++) = 2.0 * p(a, i) * p(b, i);
    }
    for (int a = 0; a < D; ++a) rows(i, k++) = 2.0 * p(a, i);
  }
  return rows;
}

double rms_about(const Eigen::VectorXd& values, double centre) {
  return std::sqrt((values.array() - centre).square().mean());
}

template <int D>
MagnetometerCalibration fit(const Eigen::Matrix3Xd& readings, const char* advice) {
  const Eigen::Index n = readings.cols();
  const Eigen::MatrixXd used = readings.topRows(D);
  const Eigen::VectorXd mean = used.rowwise().mean();
  const double spread = std::sqrt((used.colwise() - mean).squaredNorm() / static_cast<double>(n));
  if (!(spread > 0.0) || !std::isfinite(spread)) fail("they are all the same or not finite");
  const Eigen::MatrixXd rows = monomials<D>((used.colwise() - mean) / spread);
  if (n < rows.cols()) fail("at least " + std::to_string(rows.cols()) + " are needed");
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(rows, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Eigen::VectorXd singular = svd.singularValues();
  if (singular(0) > kWorstCondition * singular(singular.size() - 1)) fail(advice);
  const Eigen::VectorXd q = svd.solve(Eigen::VectorXd::Ones(n));
  Eigen::Matrix<double, D, D> quadric;
  Eigen::Index k = D;
  for (int a = 0; a < D; ++a) {
    quadric(a, a) = q(a);
    for (int b = a + 1; b < D; ++b) quadric(a, b) = quadric(b, a) = q(k++);
  }
  const Eigen::Matrix<double, D, 1> centre = -quadric.ldlt().solve(q.template tail<D>());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, D, D>> axes(quadric);
  if (!(axes.eigenvalues().minCoeff() > 0.0)) fail(advice);
  MagnetometerCalibration out;
  out.offset.head<D>() = mean + spread * centre;
  const Eigen::Matrix<double, D, D> root = axes.operatorSqrt();
  out.matrix.topLeftCorner<D, D>() = root / std::pow(root.determinant(), 1.0 / D);
  Eigen::VectorXd calibrated(n), raw(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    calibrated(i) = out(readings.col(i)).template head<D>().norm();
    raw(i) = used.col(i).norm();
  }
  out.field = calibrated.mean();
  out.residual = rms_about(calibrated, out.field);
  out.raw_residual = rms_about(raw, raw.mean());
  return out;
}

}  // namespace

MagnetometerCalibration fit_ellipsoid(const Eigen::Matrix3Xd& readings) {
  return fit<3>(readings, "turn it about all three axes, or use --planar on a robot on a floor");
}

MagnetometerCalibration fit_ellipse(const Eigen::Matrix3Xd& readings) {
  return fit<2>(readings, "turn the robot on the spot by at least one full turn");
}

}  // namespace field_ros
