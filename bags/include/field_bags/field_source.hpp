// What the simulated fields have in common.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "field_core/random.hpp"
#include "field_core/se2.hpp"

namespace field_bags {

/// One number that the robot's sensor reports.
struct Channel {
  std::string name;
  double noise_stddev = 0.0;
  /// A reading (with its noise) below this is not observed: an access point out of range.
  double floor = -std::numeric_limits<double>::infinity();
};

/// A part of the world with its channels. Deterministic once built.
class FieldSource {
 public:
  virtual ~FieldSource() = default;
  const std::vector<Channel>& channels() const { return channels_; }
  /// Noise-free values of all channels for a sensor at a pose of the map frame, appended to
  /// `values`.
  virtual void append(const field_core::SE2& sensor, std::vector<double>& values) const = 0;

 protected:
  std::vector<Channel> channels_;
};

/// A generator for one purpose, so that adding a wall does not change the noise of the odometry.
field_core::Random random_stream(std::uint64_t seed, const std::string& purpose);

}  // namespace field_bags
