// What groups of correlated fields have to obey.
#include <algorithm>
#include <set>

#include "field_core/errors.hpp"
#include "gp_localize/coregionalization.hpp"
#include "gp_localize/params.hpp"

namespace gp_localize {

using field_core::ParameterError;

namespace {

constexpr int kMostSupport = 400, kMostOpen = 600;  // of one Gaussian process

std::string quoted(const std::string& name) { return "'" + name + "'"; }

void require_fields(const std::string& key, const CoregionalizationParams& group,
                    const std::map<std::string, FieldParams>& fields,
                    std::set<std::string>& taken) {
  if (group.size() < 2) {
    throw ParameterError(key + "/fields", "names " + std::to_string(group.size()) +
                                              " of them; give two or more, or no group");
  }
  for (const std::string& name : group.fields) {
    if (fields.count(name) == 0) {
      throw ParameterError(key + "/fields", "names " + quoted(name) +
                                                ", which is not one of `fields`; add it there");
    }
    if (!taken.insert(name).second) {
      throw ParameterError(key + "/fields",
                           "names " + quoted(name) +
                               " again; a field may be in one group only, once: make one group of "
                               "all that are correlated with it");
    }
  }
  const FieldParams& first = fields.at(group.fields.front());
  for (const std::string& name : group.fields) {
    const FieldParams& field = fields.at(name);
    if (field.kernel == first.kernel && field.length_scales == first.length_scales) continue;
    throw ParameterError(
        key + "/fields",
        "have one kernel and the same length_scales, but those of " + quoted(name) +
            " are not those of " + quoted(group.fields.front()) +
            "; make them the same, or learn them with learn_hyperparameters --coregionalize");
  }
}

void require_correlations(const std::string& key, const CoregionalizationParams& group) {
  const int q = group.size(), needed = q * (q - 1) / 2;
  if (static_cast<int>(group.correlations.size()) != needed) {
    throw ParameterError(key + "/correlations",
                         "has " + std::to_string(group.correlations.size()) + " numbers; " +
                             std::to_string(q) + " fields need " + std::to_string(needed) +
                             ": the upper triangle of the matrix row by row");
  }
  const int culprit = impossible_field(correlation_matrix(q, group.correlations));
  if (culprit < 0) return;
  throw ParameterError(
      key + "/correlations",
      "cannot be: given those of the fields before it, the ones of " +
          quoted(group.fields[culprit]) +
          " leave no positive definite matrix; bring them closer to 0, or learn all of them with "
          "learn_hyperparameters --coregionalize");
}

}  // namespace

void GpLocalizeParams::validate_coregionalization() const {
  std::set<std::string> taken;
  for (const auto& [name, group] : coregionalization) {
    const std::string key = "coregionalization/" + name;
    require_fields(key, group, fields, taken);
    require_correlations(key, group);
    const int q = group.size();
    const int points = support.selection == SupportSelection::explicit_points
                           ? static_cast<int>(support.points.size())
                           : support.size;
    if (q * (points + support.budget) > kMostSupport) {
      throw ParameterError("support/size", "and support/budget are for each of the " +
                                               std::to_string(q) + " fields of " + key +
                                               ": together at most " +
                                               std::to_string(kMostSupport / q) + " points");
    }
    if (q * slice_size > kMostOpen) {
      throw ParameterError("slice_size", "must be at most " + std::to_string(kMostOpen / q) +
                                             " with the " + std::to_string(q) + " fields of " +
                                             key);
    }
  }
  if (coregionalization.empty()) return;
  if (observation_model != ObservationModelType::online_pitc &&
      observation_model != ObservationModelType::online_pitc_assimilated &&
      observation_model != ObservationModelType::fitc) {
    throw ParameterError("observation_model",
                         "is one of the paper's baselines, which know no coregionalization; use "
                         "online_pitc, online_pitc_assimilated or fitc, or leave the groups out");
  }
  if (support.noisy) {
    throw ParameterError("support/noisy", "is not offered with coregionalization; make it false");
  }
  if (outlier_share > 0.0) {
    throw ParameterError("outlier_share",
                         "is not offered with coregionalization, where an outlier of one field "
                         "would mislead the others; make it 0, or leave the groups out");
  }
}

}  // namespace gp_localize
