#include "gp_localize/resampling.hpp"

#include <algorithm>
#include <cmath>

namespace gp_localize {

bool normalize_log_weights(std::vector<double>& w) {
  if (w.empty()) return false;
  double largest = -INFINITY;
  for (const double v : w) {
    if (std::isnan(v)) return false;
    largest = std::max(largest, v);
  }
  if (!std::isfinite(largest)) return false;
  double total = 0.0;
  for (double& v : w) total += v = std::exp(v - largest);
  for (double& v : w) v /= total;
  return true;
}

double effective_sample_size(const std::vector<double>& weights) {
  double squares = 0.0;
  for (const double w : weights) squares += w * w;
  return 1.0 / squares;
}

void low_variance_resample(const std::vector<double>& weights, double offset, std::size_t count,
                           std::vector<int>& ancestors) {
  ancestors.resize(count);
  double cumulative = weights[0];
  std::size_t from = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double u = (static_cast<double>(i) + offset) / static_cast<double>(count);
    while (u >= cumulative && from + 1 < weights.size()) cumulative += weights[++from];
    ancestors[i] = static_cast<int>(from);
  }
}

void resample_shuffled(const std::vector<double>& weights, std::size_t count,
                       field_core::Random& random, std::vector<int>& ancestors) {
  low_variance_resample(weights, random.uniform(), count, ancestors);
  for (std::size_t c = count - 1; c > 0; --c)
    std::swap(ancestors[c], ancestors[random.index(c + 1)]);
}

}  // namespace gp_localize
