// A simulated run of a robot through a world.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "field_bags/recording.hpp"
#include "field_bags/world.hpp"

namespace field_bags {

/// One recording per robot of the world; the same world and seed give the same. Stamps start at
/// 1000 s, so that no stamp is 0 (which ROS takes for "now" in many places). Poses are rounded to
/// 1e-6 m and rad, readings to 1e-4 of their unit: the last bits of mathematics libraries do not
/// show, and bags stay small. The odometry starts at the origin of the frame odom; truth has the
/// rate of the odometry.
std::vector<Recording> simulate_all(const WorldParams& params, std::uint64_t seed);

/// The only robot of a world.
Recording simulate(const WorldParams& params, std::uint64_t seed);

/// CSV of a survey of the same world: x_m, y_m and one noisy reading per channel (empty: not heard)
/// on a grid over the area, for learn_hyperparameters. Rows where nothing is heard are left out.
std::string simulate_survey(const WorldParams& params, std::uint64_t seed, double spacing);

}  // namespace field_bags
