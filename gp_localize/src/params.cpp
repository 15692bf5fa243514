#include "gp_localize/params.hpp"

#include <string>

#include "field_core/errors.hpp"

namespace gp_localize {

using field_core::ParameterError;

void SupportParams::validate() const {
  if (!(region[0] < region[2] && region[1] < region[3])) {
    throw ParameterError(
        "support/region",
        "must be [x_min, y_min, x_max, y_max] with x_min < x_max and y_min < y_max");
  }
  if (selection == SupportSelection::explicit_points && points.empty()) {
    throw ParameterError("support/points",
                         "selection: explicit needs a list of points [[x, y], ...]");
  }
  if (size + budget > 400) {
    throw ParameterError("support/budget", "and support/size must not be more than 400 together");
  }
  if (points.size() + budget > 400) {
    throw ParameterError("support/points", std::to_string(points.size()) +
                                               " points are too many; at most 400 are allowed");
  }
}

void GpLocalizeParams::validate() const {
  if (fields.empty()) {
    throw ParameterError("fields", "names no field; give at least one, with its hyperparameters");
  }
  const bool sparse = observation_model == ObservationModelType::online_pitc ||
                      observation_model == ObservationModelType::online_pitc_assimilated ||
                      observation_model == ObservationModelType::fitc;
  if (map_hypotheses == MapHypotheses::particle && !sparse) {
    throw ParameterError(
        "observation_model",
        "is one of the paper's baselines, which have shared sample paths; use "
        "map_hypotheses: sample_paths, or online_pitc, online_pitc_assimilated, fitc");
  }
  if (map_hypotheses != MapHypotheses::particle && (known_map() || !survey.empty())) {
    throw ParameterError("map_hypotheses",
                         "must be particle for modes localization and lifelong, and with a survey");
  }
  if (map_hypotheses != MapHypotheses::particle && support.budget > 0) {
    throw ParameterError("support/budget", "needs map_hypotheses: particle");
  }
  if (candidates.count() > 1 && (map_hypotheses != MapHypotheses::particle || known_map())) {
    throw ParameterError("candidates",
                         "needs map_hypotheses: particle and mode: mapping; a known map was made "
                         "with one set of hyperparameters");
  }
  if (candidates.survey_correlation.size() > 1 && survey.empty()) {
    throw ParameterError("candidates/survey_correlation", "needs a file that is named by `survey`");
  }
  if (variance_dof > 0.0 && map_hypotheses != MapHypotheses::particle) {
    throw ParameterError("variance_dof", "needs map_hypotheses: particle");
  }
  if (variance_dof > 0.0 && (outlier_share > 0.0 || field_offset.stddev > 0.0)) {
    throw ParameterError(
        "variance_dof",
        "cannot be used with outlier_share or field_offset/stddev: its density has "
        "heavy tails already, and a drift would pass for a larger variance");
  }
  if (field_offset.stddev > 0.0 && mode != Mode::localization) {
    throw ParameterError(
        "field_offset/stddev",
        "needs mode: localization; a map that is still learned takes up the drift");
  }
  if (support.selection == SupportSelection::survey && survey.empty()) {
    throw ParameterError("support/selection", "is survey, but no file is named by `survey`");
  }
  if (adaptive.min_particles > particles) {
    throw ParameterError("adaptive/min_particles", "must not be larger than particles");
  }
  validate_coregionalization();
}

}  // namespace gp_localize
