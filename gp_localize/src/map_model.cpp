#include "gp_localize/map_model.hpp"

#include "field_core/errors.hpp"
#include "sample_path_map.hpp"

namespace gp_localize {

std::unique_ptr<MapModel> make_map_model(const GpLocalizeParams& params,
                                         const std::vector<FieldModel>& fields) {
  if (params.map_hypotheses != MapHypotheses::sample_paths) {
    throw field_core::ParameterError("map_hypotheses",
                                     "'particle' is not offered yet; use sample_paths");
  }
  GpLocalizeParams p = params;
  if (params.observation_model == ObservationModelType::fitc) {
    p.observation_model = ObservationModelType::online_pitc;
    p.slice_size = 1;
  } else if (params.observation_model != ObservationModelType::online_pitc &&
             params.observation_model != ObservationModelType::online_pitc_assimilated) {
    throw field_core::ParameterError(
        "observation_model", "not offered yet; use online_pitc, online_pitc_assimilated or fitc");
  }
  return std::make_unique<SamplePathMap>(p, fields);
}

}  // namespace gp_localize
