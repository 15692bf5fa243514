// Choice of the support set S before the run (paper, remark after definition 1).
#pragma once

#include <Eigen/Core>

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
/// @throws ParameterError if `explicit` has no points
Eigen::Matrix2Xd select_support(const SupportParams& params, const field_core::Kernel& kernel,
                                double noise_variance);

}  // namespace gp_localize
