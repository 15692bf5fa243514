// Choice of the support set S before the run (paper, remark after definition 1).
#pragma once

#include <Eigen/Core>
#include <string>

#include "gp_localize/params.hpp"

namespace gp_localize {

/// Support points in the map frame, 2 x m with m <= params.size (m = size unless the grid does not
/// divide so; explicit points as given). Deterministic.
///   grid            cell centres of the most square grid over the region
///   farthest_point  greedy k-centre (Gonzalez 1985) over a fine lattice, from its centre outwards
///   mutual_information  greedy maximization of the mutual information between chosen and other
///   places
///                   of a lattice (Krause, Singh, Guestrin 2008), under `kernel`; O(size n^2), n <=
///                   400
///   survey         greedy k-centre over the places of the survey, from their centre outwards
/// @throws ParameterError if `explicit` has no points, DataError for a survey that cannot be read
field_core::Places select_support(const SupportParams& params, const field_core::Kernel& kernel,
                                  double noise_variance, const std::string& survey = "");

/// Greedy k-centre (Gonzalez 1985): at most `size` distinct columns of `places`, each the farthest
/// from those before it, starting with the nearest to `start`. O(size n).
field_core::Places spread_over(const field_core::Places& places, const field_core::Place& start,
                               int size);

/// Greedy maximization of the mutual information between the chosen and the other columns of
/// `places` under `kernel`: `size` of them, but always fewer than there are. O(size n^2).
field_core::Places most_informative(const field_core::Places& places, int size,
                                    const field_core::Kernel& kernel, double noise_variance);

}  // namespace gp_localize
