#include "gp_localize/support_basis.hpp"

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <string>

#include "field_core/errors.hpp"
#include "vector_kernels.hpp"

namespace gp_localize {
namespace {

using Phi = std::array<double, kMaxSupport>;

std::string describe(const Places& s, Eigen::Index i) {
  std::string text = std::to_string(i) + " (";
  for (Eigen::Index a = 0; a < s.rows(); ++a) text += (a ? ", " : "") + std::to_string(s(a, i));
  return text + ")";
}

void require_distinct(const Places& s, const Place& length_scales) {
  constexpr double kSame = 1e-6;  // of a length scale: covariances then agree to the last bits
  for (Eigen::Index i = 0; i < s.cols(); ++i) {
    for (Eigen::Index j = i + 1; j < s.cols(); ++j) {
      if ((s.col(i) - s.col(j)).cwiseQuotient(length_scales).norm() > kSame) continue;
      throw field_core::NumericalError("support points " + describe(s, i) + " and " +
                                       describe(s, j) + " coincide; remove one of them");
    }
  }
}

}  // namespace

SupportBasis::SupportBasis(const field_core::Kernel& kernel, const Places& support, double jitter,
                           double noise_variance, int room, const Coregionalization& group)
    : kernel_(kernel),
      group_(group),
      first_(support.cols()),
      used_(support.cols()),
      diagonal_(jitter * kernel.signal_variance() + noise_variance),
      support_(Places::Zero(kernel.dimensions(), support.cols() + room)),
      whitening_(Features::Zero(support_.cols(), support_.cols())) {
  if (support.cols() == 0) {
    throw field_core::NumericalError("the support set is empty; give at least one support point");
  }
  if (support.rows() != kernel.dimensions()) {
    throw field_core::NumericalError(
        "support points have " + std::to_string(support.rows()) + " coordinates, the kernel has " +
        std::to_string(kernel.dimensions()) + " length scales; give one per coordinate");
  }
  support_.leftCols(used_) = support;
  require_distinct(support, kernel.length_scales());
  Eigen::MatrixXd sigma = kernel.matrix(support, support);
  sigma.diagonal().array() += diagonal_;
  const Eigen::LLT<Eigen::MatrixXd> factor(sigma);
  if (factor.info() != Eigen::Success) {
    throw field_core::NumericalError(
        "the covariance of the support points is singular: they are too close for the length "
        "scales; use fewer or wider spaced points, or raise support/jitter (1e-8 is usual)");
  }
  whitening_.topLeftCorner(used_, used_) =
      factor.matrixL().solve(Eigen::MatrixXd::Identity(used_, used_));
}

double SupportBasis::unexplained(const Place& point) const {
  Phi phi;
  kernel_features(point, phi.data());
  double explained = 0.0;
  for (Eigen::Index i = 0; i < used_; ++i) explained += phi[i] * phi[i];
  return 1.0 - explained / kernel_.signal_variance();
}

/// With l = phi(point), the new rows of L and of its inverse are (l^T, d) and (-l^T L^-1, 1) / d.
void SupportBasis::grow(const Place& point) {
  Phi phi;
  kernel_features(point, phi.data());
  const double d = std::sqrt(unexplained(point) * kernel_.signal_variance() + diagonal_);
  auto row = whitening_.row(used_);
  for (Eigen::Index k = 0; k < used_; ++k) {
    double sum = 0.0;
    for (Eigen::Index i = k; i < used_; ++i) sum += phi[i] * whitening_(i, k);
    row[k] = -sum / d;
  }
  row[used_] = 1.0 / d;
  support_.col(used_++) = point;
}

void SupportBasis::add_newest_features(const Place& point, double* phi) const {
  const Place x = point.head(dimensions());
  double sum = 0.0;
  for (Eigen::Index k = 0; k < used_; ++k) {
    sum += whitening_(used_ - 1, k) * kernel_(support_.col(k), x);
  }
  const int field = field_of(point);
  for (int j = 0; j < fields(); ++j) {
    phi[j * support_.cols() + used_ - 1] = group_.factor(field, j) * sum;
  }
}

void SupportBasis::forget_grown() {
  whitening_.middleRows(first_, used_ - first_).setZero();
  used_ = first_;
}

void SupportBasis::features(const Eigen::Ref<const Places>& points, Features& features) const {
  features.resize(size(), points.cols());
  this->features(points, features.data());
}

void SupportBasis::features(const Eigen::Ref<const Places>& points, double* features) const {
  kernel_features(points, features);
  if (fields() == 1) return;
  const Eigen::Index n = points.cols(), m = support_.cols();
  for (Eigen::Index p = 0; p < n; ++p) {
    const int field = field_of(points.col(p));
    for (int j = fields() - 1; j >= 0; --j) {  // the first block last: the others are made of it
      const double factor = group_.factor(field, j);
      for (Eigen::Index k = 0; k < m; ++k) {
        features[(j * m + k) * n + p] = factor * features[k * n + p];
      }
    }
  }
}

void SupportBasis::kernel_features(const Eigen::Ref<const Places>& points, double* features) const {
  whitened_features(
      {kernel_.type(), kernel_.signal_variance(), dimensions(), kernel_.length_scales().data(),
       static_cast<int>(support_.cols()), support_.data(), whitening_.data()},
      static_cast<int>(points.cols()), points.data(), static_cast<int>(points.outerStride()),
      features);
}

}  // namespace gp_localize
