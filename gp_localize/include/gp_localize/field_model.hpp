// What is known of each field before the run, and the measurements of one step.
#pragma once

#include <string>
#include <vector>

#include "field_core/estimator.hpp"
#include "gp_localize/params.hpp"
#include "gp_localize/support_basis.hpp"

namespace gp_localize {

/// One field: prior mean, noise, kernel and support, fixed for the run. Correlated fields are one
/// Gaussian process and have the same basis; any other field is a group of its own.
struct FieldModel {
  field_core::FieldInfo info;
  double mean;            ///< prior mean [field unit]
  double noise_variance;  ///< of one measurement
  SupportBasis basis;
  /// With the field that a survey saw: f = rho f_survey + sqrt(1 - rho^2) g, g of the same prior.
  double survey_correlation = 1.0;
  int group = 0;   ///< number of the Gaussian process; they are in the order of their first fields
  int member = 0;  ///< which of the group's fields

  double signal_variance() const { return basis.prior(member, member); }
  /// The basis' place of this field at `x`, which is without the field's number.
  Place place(const Place& x) const;
  /// Likewise many, d x n; the second allocates only where `at` has another size.
  Places places(const Eigen::Ref<const Places>& x) const;
  void places(const Eigen::Ref<const Places>& x, Places& at) const;
};

/// One field's measurement of a step.
struct Observation {
  int field;
  double value;                ///< minus the field's prior mean
  double noise_variance;       ///< with which the map learns it
  double likelihood_variance;  ///< noise with which particles are weighed
  field_core::Stamp stamp{0};
};

/// Builds the models of all fields over one support set, ordered by name.
/// @throws ParameterError naming the field, for a support set that cannot be used too, or for a
///         group whose fields cannot be correlated so, with the remedy
std::vector<FieldModel> make_field_models(const GpLocalizeParams& params);

/// The first field of every group, by number of the group.
std::vector<int> first_fields(const std::vector<FieldModel>& fields);

/// For each field, its model under every combination of params.candidates: length scales vary
/// fastest, then noise, signal and survey_correlation; those of correlated fields all take the
/// same multiples. One support set each, that of the configured model.
std::vector<std::vector<FieldModel>> make_candidates(const GpLocalizeParams& params,
                                                     const std::vector<FieldModel>& fields);

}  // namespace gp_localize
