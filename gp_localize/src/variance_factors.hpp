// What a field's configured variances are worth: signal and noise variance of a group of fields
// have an unknown common factor with the prior inverse gamma (dof / 2, dof / 2), marginalized
// exactly per particle. A reading's density is then Student's t, and a path is weighed by how the
// errors compare with each other, not by how they compare with a variance that may be wrong.
#pragma once

#include <vector>

#include "field_core/state.hpp"
#include "gp_localize/params.hpp"

namespace gp_localize {

/// The posterior of a particle's factor is inverse gamma (a, b_p): a grows by e / 2 with each
/// reading, b_p by e error^2 / (2 variance), e being the likelihood's exponent. What is added while
/// weighing counts from accept() on, so that a step that no particle explains changes nothing.
class VarianceFactors {
 public:
  /// For at most params.particles particles; inactive where params.variance_dof is 0.
  VarianceFactors(const GpLocalizeParams& params, std::size_t groups);

  bool active() const { return prior_ > 0.0; }
  /// Back to the prior.
  void restart();
  /// A step begins.
  void begin();
  /// The next reading of a group is weighed: call before density() of all particles.
  void reading(int group) { ++readings_[group]; }
  /// Log density of a reading that errs by `error`, up to a constant and divided by the exponent;
  /// `variance` is that of the configured model and becomes that under the factor. O(1).
  double density(std::size_t particle, int group, double error, double& variance);
  /// The step's readings count.
  void accept();

  /// 1 over the posterior mean of 1 / factor.
  double factor(std::size_t particle, int group) const {
    return active() ? scale_[particle * shape_.size() + group] / shape_[group] : 1.0;
  }

  /// As MapModel::resampled.
  void resampled(const std::vector<int>& ancestors);
  void save(field_core::State& state) const;
  /// A state without factors leaves the prior. @throws DataError
  void restore(const field_core::State& state, const std::vector<int>& ancestors);

 private:
  double prior_;                            // dof / 2; 0: inactive
  double exponent_;                         // e
  std::vector<double> shape_, next_shape_;  // a, one per group
  std::vector<int> readings_;               // of this step, one per group
  std::vector<double> scale_, next_scale_;  // b [particle * groups + group]; next_: of this step
};

}  // namespace gp_localize
