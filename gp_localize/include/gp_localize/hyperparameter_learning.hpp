// Hyperparameters of a field by maximum likelihood, from measurements at known places.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "gp_localize/marginal_likelihood.hpp"
#include "gp_localize/survey.hpp"

namespace gp_localize {

struct LearningOptions {
  /// The one with the highest likelihood is kept.
  std::vector<field_core::KernelType> kernels = {field_core::KernelType::squared_exponential};
  int starts = 6;
  std::uint64_t seed = 1;
  int exact_up_to = 600;  ///< measurements; above: PITC
  int support = 100;      ///< support points of PITC, spread over the measured places
  int slice_size = 20;    ///< consecutive measurements of a slice
};

struct LearnedField {
  field_core::KernelType kernel;
  Hyperparameters value;
  /// From the observed information (the inverse of the negative Hessian at the maximum); NaN for
  /// what the measurements do not determine.
  Hyperparameters standard_error;
  double log_likelihood;
  int measurements;
  bool exact;
  int starts, agreeing;  ///< how many starts there were, and how many found this maximum
};

/// Called before each start: which one, and the best log likelihood so far.
using LearningProgress = std::function<void(int start, int starts, double best)>;

/// Maximum of the marginal likelihood by L-BFGS from several starts (Ceres). Length scales are
/// sought between 1/200 and 10 times the extent of the places, standard deviations relative to that
/// of the values. O(starts n^3) exact, O(starts n m^2) PITC.
/// @throws DataError for fewer than 10 measurements, equal values or a single place;
///         NumericalError if no start converges
LearnedField learn_hyperparameters(const FieldSurvey& survey, const LearningOptions& options,
                                   const LearningProgress& progress = {});

/// Correlated fields, learned together.
struct LearnedGroup {
  std::vector<std::string> names;
  /// As of one field each; kernel, length scales, log likelihood, exact, starts and agreeing are
  /// the group's.
  std::vector<LearnedField> fields;
  Eigen::MatrixXd correlation, correlation_error;  ///< q x q; errors may be NaN, as those of fields
};

/// The same for a group of correlated fields, `names` of the survey, under the intrinsic
/// coregionalization model: common kernel and length scales, correlations between the fields, and
/// mean, signal and noise of each. n counts the measurements of all. PITC has q times as many
/// support values.
/// @throws DataError likewise, naming the field
LearnedGroup learn_group(const Survey& survey, const std::vector<std::string>& names,
                         const LearningOptions& options, const LearningProgress& progress = {});

/// The group as an entry of `coregionalization:` in a configuration.
std::string to_yaml(const std::string& name, const LearnedGroup& group);

/// The field as an entry of `fields:` in a configuration, with what is known of it as comments.
std::string to_yaml(const std::string& name, const std::string& unit, const LearnedField& field);

}  // namespace gp_localize
