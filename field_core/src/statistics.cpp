// Statistics of errors and densities of predictions.
#include <algorithm>
#include <cmath>
#include <limits>

#include "field_core/errors.hpp"
#include "field_core/metrics.hpp"

namespace field_core {
namespace {

// Quantile of sorted values with linear interpolation between ranks.
double quantile(const std::vector<double>& sorted, double share) {
  const double rank = share * static_cast<double>(sorted.size() - 1);
  const auto low = static_cast<std::size_t>(rank);
  const auto high = std::min(low + 1, sorted.size() - 1);
  return sorted[low] + (rank - static_cast<double>(low)) * (sorted[high] - sorted[low]);
}

}  // namespace

ErrorStatistics error_statistics(const std::vector<double>& errors) {
  if (errors.empty()) {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    return {nan, nan, nan, nan, nan, nan};
  }
  std::vector<double> sorted = errors;
  std::sort(sorted.begin(), sorted.end());
  double sum = 0.0, squares = 0.0;
  for (const double error : errors) {
    sum += error;
    squares += error * error;
  }
  const auto count = static_cast<double>(errors.size());
  return {sum / count,   quantile(sorted, 0.5), std::sqrt(squares / count), quantile(sorted, 0.95),
          sorted.back(), errors.back()};
}

double negative_log_predictive_density(const Eigen::VectorXd& values, const Eigen::VectorXd& means,
                                       const Eigen::VectorXd& variances) {
  if (values.size() == 0 || values.size() != means.size() || values.size() != variances.size()) {
    throw NumericalError("a predictive density needs as many means (" +
                         std::to_string(means.size()) + ") and variances (" +
                         std::to_string(variances.size()) + ") as values (" +
                         std::to_string(values.size()) + "), and at least one");
  }
  double sum = 0.0;
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    if (!(variances[i] > 0.0)) {
      throw NumericalError("the predicted variance of value " + std::to_string(i) +
                           " is not positive; add the measurement noise to it");
    }
    const double error = values[i] - means[i];
    sum += std::log(2.0 * M_PI * variances[i]) + error * error / variances[i];
  }
  return 0.5 * sum / static_cast<double>(values.size());
}

}  // namespace field_core
