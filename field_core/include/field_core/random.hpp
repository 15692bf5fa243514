// The one source of randomness of an estimator: explicitly seeded, the same numbers on every
// platform.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <random>
#include <string>

namespace field_core {

/// Mersenne twister with our own uniform and normal transforms (the standard's differ
/// between libraries).
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  /// Uniform in [0, 1), 53 bits.
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1.0p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Uniform in 0 .. count - 1; count > 0.
  std::size_t index(std::size_t count);
  /// Standard normal (Marsaglia polar; the second value is kept for the next call).
  double normal();
  double normal(double mean, double stddev) { return mean + stddev * normal(); }
  /// Student t with `degrees` of freedom, location 0, scale 1; degrees > 0.
  double student_t(double degrees);
  /// Draw from N(0, covariance); covariance positive semi-definite (pivoted LDLT), zero allowed.
  Eigen::Vector3d normal3(const Eigen::Matrix3d& covariance);

  /// Text of the complete state, and back; throws DataError if the text is not one.
  std::string state() const;
  void restore(const std::string& state);

 private:
  std::mt19937_64 engine_;
  bool has_spare_ = false;
  double spare_ = 0.0;
};

}  // namespace field_core
