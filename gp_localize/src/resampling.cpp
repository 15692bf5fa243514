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

void low_variance_resample(const std::vector<double>& weights, double offset,
                           std::vector<int>& ancestors) {
  const int n = static_cast<int>(weights.size());
  ancestors.resize(n);
  double cumulative = weights[0];
  int from = 0;
  for (int i = 0; i < n; ++i) {
    const double u = (i + offset) / n;
    while (u >= cumulative && from + 1 < n) cumulative += weights[++from];
    ancestors[i] = from;
  }
}

}  // namespace gp_localize
