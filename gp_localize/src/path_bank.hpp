// One field as all sample paths know it: the observation model of eq. (9), one implementation per
// way of learning the field along a path.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "field_core/state.hpp"
#include "gp_localize/field_model.hpp"
#include "gp_localize/params.hpp"
#include "path_panels.hpp"

namespace gp_localize {

class PathBank {
 public:
  virtual ~PathBank() = default;
  /// Forgets all measurements.
  virtual void restart() = 0;

  /// Clears the sums of log densities of `particles` particles x paths, which this bank then keeps
  /// for all fields of a step.
  virtual void begin(int particles) = 0;
  /// Adds this field's log density of `value` at places (d x P) under every path to the sums that
  /// `total`, a bank of the same kind, keeps.
  /// @param moments 2 x P: per place, mean and mean square of the paths' predictions
  virtual void add(const Places& places, double value, double noise_variance, PathBank& total,
                   Eigen::Matrix2Xd& moments) = 0;
  /// Likewise the joint density of several fields of a group, read together at places (without the
  /// field's number). moments[k]: of reading k given those before it.
  /// @throws ParameterError unless the model knows groups
  virtual void add_joint(const Places& places, const std::vector<Reading>& readings,
                         PathBank& total, std::vector<Eigen::Matrix2Xd>& moments);
  /// Per particle, log of the mean over paths of the densities summed up since begin().
  virtual void log_mean(std::vector<double>& log_likelihood) const = 0;

  /// Path c measured `value` at places.col(c).
  virtual void learn(const Places& places, double value, double noise_variance) = 0;
  virtual void close_slice() = 0;
  /// Moments over the paths of the noise-free field, in double precision.
  virtual void predict(const Places& points, Eigen::Matrix2Xd& moments) const = 0;

  virtual void save(field_core::State& state) const = 0;
  /// Checks shapes before anything changes. @throws DataError
  virtual void check(const field_core::State& state) const = 0;
  virtual void restore(const field_core::State& state) = 0;
};

/// The bank for params.observation_model; `field` must outlive it.
std::unique_ptr<PathBank> make_path_bank(const GpLocalizeParams& params, const FieldModel& field);

}  // namespace gp_localize
