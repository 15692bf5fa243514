#include "field_core/kernels.hpp"

#include <cmath>

#include "field_core/errors.hpp"

namespace field_core {
namespace {

void require_positive(const char* key, double value) {
  if (!(value > 0.0) || !std::isfinite(value)) {
    throw ParameterError(key,
                         std::to_string(value) + " is not allowed; it must be a positive number");
  }
}

}  // namespace

double correlation(KernelType type, double r2) {
  switch (type) {
    case KernelType::squared_exponential:
      return std::exp(-0.5 * r2);
    case KernelType::matern32: {
      const double r = std::sqrt(3.0 * r2);
      return (1.0 + r) * std::exp(-r);
    }
    case KernelType::matern52: {
      const double r = std::sqrt(5.0 * r2);
      return (1.0 + r + r * r / 3.0) * std::exp(-r);
    }
  }
  throw ParameterError("kernel", "not one of squared_exponential, matern32, matern52");
}

double correlation_slope(KernelType type, double r2) {
  switch (type) {
    case KernelType::squared_exponential:
      return -0.5 * std::exp(-0.5 * r2);
    case KernelType::matern32:
      return -1.5 * std::exp(-std::sqrt(3.0 * r2));
    case KernelType::matern52: {
      const double r = std::sqrt(5.0 * r2);
      return -5.0 / 6.0 * (1.0 + r) * std::exp(-r);
    }
  }
  throw ParameterError("kernel", "not one of squared_exponential, matern32, matern52");
}

Kernel::Kernel(KernelType type, double signal_stddev, const Eigen::Vector2d& length_scales)
    : type_(type),
      signal_variance_(signal_stddev * signal_stddev),
      length_scales_(checked(signal_stddev, length_scales)) {}

Place Kernel::checked(double signal_stddev, const Eigen::VectorXd& length_scales) {
  require_positive("signal_stddev", signal_stddev);
  if (length_scales.size() < 1 || length_scales.size() > kMostDimensions) {
    throw ParameterError("length_scales", std::to_string(length_scales.size()) +
                                              " of them are not allowed; give 1 to " +
                                              std::to_string(kMostDimensions));
  }
  for (const double length : length_scales) require_positive("length_scales", length);
  return length_scales;
}

double Kernel::covariance(double squared_distance) const {
  return signal_variance_ * correlation(type_, squared_distance);
}

double Kernel::operator()(const Eigen::Vector2d& a, const Eigen::Vector2d& b) const {
  return covariance((a - b).cwiseQuotient(length_scales_).squaredNorm());
}

Eigen::MatrixXd Kernel::matrix(const Eigen::Ref<const Places>& a,
                               const Eigen::Ref<const Places>& b) const {
  Eigen::MatrixXd k(a.cols(), b.cols());
  for (Eigen::Index j = 0; j < b.cols(); ++j) {
    for (Eigen::Index i = 0; i < a.cols(); ++i) k(i, j) = (*this)(a.col(i), b.col(j));
  }
  return k;
}

}  // namespace field_core
