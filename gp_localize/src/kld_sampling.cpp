#include "gp_localize/kld_sampling.hpp"

#include <algorithm>
#include <cmath>

namespace gp_localize {

double kld_bound(int bins, double error, double z) {
  if (bins < 2) return 1.0;
  const double k = bins - 1.0, b = 2.0 / (9.0 * k);
  return k / (2.0 * error) * std::pow(1.0 - b + std::sqrt(b) * z, 3);
}

PoseBins::PoseBins(int most_poses) {
  std::size_t size = 16;
  while (size < 2 * static_cast<std::size_t>(most_poses)) size *= 2;
  table_.assign(size, 0);
}

void PoseBins::clear() {
  std::fill(table_.begin(), table_.end(), 0);
  count_ = 0;
}

bool PoseBins::insert(const field_core::SE2& pose) {
  constexpr double kCell = 0.5, kAngle = M_PI / 18.0;
  const auto cell = [](double v, double size) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(v / size))) & 0x1fffff;
  };
  // 21 bits each, and one that says that there is an entry.
  const std::uint64_t key = (cell(pose.x(), kCell) << 42) | (cell(pose.y(), kCell) << 21) |
                            cell(pose.yaw(), kAngle) | (std::uint64_t{1} << 63);
  std::size_t at = (key * 0x9e3779b97f4a7c15u) >> 20;
  for (at &= table_.size() - 1; table_[at] != 0; at = (at + 1) & (table_.size() - 1)) {
    if (table_[at] == key) return false;
  }
  table_[at] = key;
  ++count_;
  return true;
}

void kld_resample(const std::vector<double>& weights, const std::vector<field_core::SE2>& poses,
                  const KldLimits& limits, PoseBins& bins, field_core::Random& random,
                  std::vector<double>& cumulative, std::vector<int>& ancestors) {
  cumulative.resize(weights.size());
  double sum = 0.0;
  for (std::size_t i = 0; i < weights.size(); ++i) cumulative[i] = sum += weights[i];
  bins.clear();
  ancestors.clear();
  double needed = limits.least;
  while (static_cast<int>(ancestors.size()) < limits.most && ancestors.size() < needed) {
    const double u = random.uniform() * sum;
    const auto it = std::upper_bound(cumulative.begin(), cumulative.end(), u);
    const auto i = std::min<std::size_t>(it - cumulative.begin(), weights.size() - 1);
    ancestors.push_back(static_cast<int>(i));
    if (bins.insert(poses[i])) {
      needed = std::max<double>(limits.least, kld_bound(bins.count(), limits.error, limits.z));
    }
  }
  std::sort(ancestors.begin(), ancestors.end());
}

}  // namespace gp_localize
