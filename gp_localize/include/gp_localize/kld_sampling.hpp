// How many particles a belief needs: KLD sampling (Fox, "Adapting the sample size in particle
// filters through KLD-sampling", IJRR 2003; Probabilistic Robotics, table 8.4).
#pragma once

#include <cstdint>
#include <vector>

#include "field_core/random.hpp"
#include "field_core/se2.hpp"

namespace gp_localize {

/// Particles with which the distance between the sampled and the true distribution over `bins`
/// occupied bins stays below `error` with the probability whose normal quantile is `z` (eq. 7).
double kld_bound(int bins, double error, double z);

/// The set of bins (0.5 m x 0.5 m x 10 degrees, amcl's) that poses occupy. Fixed memory.
class PoseBins {
 public:
  explicit PoseBins(int most_poses);
  void clear();
  /// True if the pose is the first of its bin. O(1).
  bool insert(const field_core::SE2& pose);
  int count() const { return count_; }

 private:
  std::vector<std::uint64_t> table_;  // open addressing; 0: empty
  int count_ = 0;
};

struct KldLimits {
  int least, most;
  double error, z;
};

/// Draws ancestors by their weights (which sum to 1) one by one until the bound holds; sorted.
/// O(n log n) for n draws.
void kld_resample(const std::vector<double>& weights, const std::vector<field_core::SE2>& poses,
                  const KldLimits& limits, PoseBins& bins, field_core::Random& random,
                  std::vector<double>& cumulative, std::vector<int>& ancestors);

}  // namespace gp_localize
