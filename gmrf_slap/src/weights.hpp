// Small functions on logarithms of densities and on weights.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <vector>

namespace gmrf_slap {

/// A hypothesis below this is kept, so that it can come back.
constexpr double kSmallestProbability = 1e-300;

inline double log_normal(double residual, double variance) {
  return -0.5 * (residual * residual / variance + std::log(variance) + 1.8378770664093454836);
}

/// log(exp(a) + exp(b) + ...), one after the other.
class LogSum {
 public:
  void add(double x) {
    if (x <= largest_) {
      if (x > -std::numeric_limits<double>::infinity()) sum_ += std::exp(x - largest_);
    } else {
      sum_ = sum_ * std::exp(largest_ - x) + 1.0;
      largest_ = x;
    }
  }
  double value() const { return largest_ + std::log(sum_); }

 private:
  double largest_ = -std::numeric_limits<double>::infinity();
  double sum_ = 0.0;
};

/// Logarithms up to a constant -> probabilities.
inline void exponentiate_and_normalize(Eigen::VectorXd& logs) {
  logs = (logs.array() - logs.maxCoeff()).exp();
  logs /= logs.sum();
}

/// Systematic resampling (Kitagawa 1996): how often each weight (sum 1) is drawn; 0 <= u < 1.
inline void systematic_offspring(const Eigen::VectorXd& weights, double u,
                                 std::vector<int>& offspring) {
  const auto n = static_cast<std::size_t>(weights.size());
  offspring.assign(n, 0);
  double sum = 0.0;
  std::size_t drawn = 0;
  for (std::size_t p = 0; p < n; ++p) {
    sum += weights[static_cast<Eigen::Index>(p)] * static_cast<double>(n);
    while (drawn < n && static_cast<double>(drawn) + u < sum) {
      ++offspring[p];
      ++drawn;
    }
  }
  // Rounding may leave the last draw open.
  Eigen::Index heaviest = 0;
  weights.maxCoeff(&heaviest);
  offspring[static_cast<std::size_t>(heaviest)] += static_cast<int>(n - drawn);
}

}  // namespace gmrf_slap
