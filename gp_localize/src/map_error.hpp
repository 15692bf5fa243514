// What a known map leaves open of a field is nearly the same at the next reading, a step further
// on: readings of one field then err together, and their likelihoods, multiplied, would make the
// filter sure of what it has seen only once. So a reading's likelihood is raised to a power.
//
// For errors of variance v that are correlated by rho(d), noise of variance n, and what the pose's
// error changes of the readings, correlated as the field's gradient is by gamma(d), the score of
// the independent likelihood has the expected slope N / (n + v) and the variance N (n + v r) / (n +
// v)^2 per unit of gradient, r = sum over the readings of rho gamma. The power that makes the two
// equal (magnitude adjustment of a composite likelihood: Pauli, Racugno, Ventura 2011) is (n + v) /
// (n + v r).
//
// r is 1 + 2 c, c being a count of the earlier readings that is forgotten exponentially with the
// distance driven: over a steady drive r is the integral of rho gamma over the distance between
// readings. Where the robot stands still all its readings are counted, so that they weigh little
// more than one; as it drives on they are counted as one, for no more has been learned of them.
#pragma once

#include <vector>

#include "field_core/state.hpp"
#include "gp_localize/field_model.hpp"

namespace gp_localize {

/// All calls are O(fields) or less.
class MapError {
 public:
  /// Inactive unless the mode is localization and params.map_error_correlation is set.
  MapError(const GpLocalizeParams& params, const std::vector<FieldModel>& fields);

  bool active() const { return active_; }
  void restart();
  /// The robot drove [m].
  void move(double distance);
  /// A reading of the field was used.
  void accept(int field) { standing_[field] += 1.0; }
  /// Of the likelihood of a reading of the field, where the map's variance is `map_variance`.
  double power(int field, double map_variance, double noise_variance) const;

  /// The integral of rho gamma over the whole line, in length scales; mean of a gradient along the
  /// line and one across it.
  static double integral(field_core::KernelType type);

  void save(field_core::State& state) const;
  /// A state without counts, saved while mapping, leaves none. @throws DataError
  void restore(const field_core::State& state);

 private:
  bool active_;
  std::vector<double> memory_;    // of each field: distance over which a reading is forgotten [m]
  std::vector<double> count_;     // of each field: readings before the robot last moved
  std::vector<double> standing_;  // and since then
  double moved_ = 0.0;            // not yet taken for motion [m]
};

}  // namespace gp_localize
