// Slow drift of a whole field against its known map (daylight, another phone, a weaker battery):
// per particle and field an offset that is added to every measurement, with the Ornstein-Uhlenbeck
// process as its prior, marginalized by a scalar Kalman filter. The map's own error at a place
// counts as independent noise.
#pragma once

#include <vector>

#include "field_core/state.hpp"
#include "gp_localize/field_model.hpp"

namespace gp_localize {

class FieldOffsets {
 public:
  /// For at most params.particles particles; inactive where params.field_offset.stddev is 0.
  FieldOffsets(const GpLocalizeParams& params, const std::vector<FieldModel>& fields);

  bool active() const { return memory_ > 0.0; }
  /// Back to the prior.
  void restart();
  /// The field is measured at `stamp`: offsets have wandered since it was last. O(particles).
  void advance(int field, field_core::Stamp stamp);

  double mean(std::size_t particle, int field) const { return at(particle, field).mean; }
  double variance(std::size_t particle, int field) const { return at(particle, field).variance; }
  /// A measurement that differs by `error` from map and offset, of `variance` in all. O(1).
  void learn(std::size_t particle, int field, double error, double variance);

  /// As MapModel::resampled.
  void resampled(const std::vector<int>& ancestors);
  void save(field_core::State& state) const;
  /// A state without offsets, saved while mapping, leaves the prior. @throws DataError
  void restore(const field_core::State& state, const std::vector<int>& ancestors);

 private:
  struct Offset {
    double mean, variance;
  };
  const Offset& at(std::size_t p, int field) const { return offsets_[p * prior_.size() + field]; }

  double memory_;              // [s]; 0: inactive
  std::vector<double> prior_;  // variances, one per field
  std::vector<field_core::Stamp> last_;
  std::vector<bool> measured_;
  std::vector<Offset> offsets_, children_;  // [particle * fields + field]
};

}  // namespace gp_localize
