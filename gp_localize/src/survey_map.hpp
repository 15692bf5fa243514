// A map from measurements at known places.
#pragma once

#include <vector>

#include "gp_localize/field_model.hpp"
#include "gp_localize/open_slice.hpp"
#include "gp_localize/survey.hpp"

namespace gp_localize {

/// The support of each group of fields given the survey in the file `path`: PITC with slices of 50
/// measurements per field of the group in the order of the file. O(n m^2).
/// @throws DataError naming file, line and column
std::vector<SupportPosterior> map_from_survey(const std::string& path,
                                              const std::vector<FieldModel>& fields);

}  // namespace gp_localize
