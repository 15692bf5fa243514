// What is known of each field before the run, and the measurements of one step.
#pragma once

#include <string>
#include <vector>

#include "field_core/estimator.hpp"
#include "gp_localize/params.hpp"
#include "gp_localize/support_basis.hpp"

namespace gp_localize {

/// One field: prior mean, noise, kernel and support, fixed for the run.
struct FieldModel {
  field_core::FieldInfo info;
  double mean;            ///< prior mean [field unit]
  double noise_variance;  ///< of one measurement
  SupportBasis basis;
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
/// @throws ParameterError naming the field, for a support set that cannot be used too
std::vector<FieldModel> make_field_models(const GpLocalizeParams& params);

/// For each field, its model under every combination of params.candidates: length scales vary
/// fastest, then noise, then signal. One support set each, that of the configured model.
std::vector<std::vector<FieldModel>> make_candidates(const GpLocalizeParams& params,
                                                     const std::vector<FieldModel>& fields);

}  // namespace gp_localize
