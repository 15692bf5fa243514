// Weights of particles: normalization, effective sample size, low-variance resampling.
#pragma once

#include <vector>

#include "field_core/random.hpp"

namespace gp_localize {

/// Turns log weights into weights that sum to 1, in place. False, and nothing changed, if none is
/// finite.
bool normalize_log_weights(std::vector<double>& log_weights);

/// 1 / sum w^2 of normalized weights: between 1 and the number of particles (Liu 1996).
double effective_sample_size(const std::vector<double>& weights);

/// Low-variance sampling (Probabilistic Robotics, table 4.4): ancestors[i] is the particle that the
/// i-th of `count` new ones copies, not decreasing; each particle with weight w gets floor or ceil
/// of count w copies.
/// @param offset uniform in [0, 1)
void low_variance_resample(const std::vector<double>& weights, double offset, std::size_t count,
                           std::vector<int>& ancestors);
/// The same draws in random order, for copies whose order means something.
void resample_shuffled(const std::vector<double>& weights, std::size_t count,
                       field_core::Random& random, std::vector<int>& ancestors);

}  // namespace gp_localize
