#include "gp_localize/map_model.hpp"

#include "field_core/errors.hpp"
#include "particle_map.hpp"
#include "sample_path_map.hpp"

namespace gp_localize {

std::unique_ptr<MapModel> make_map_model(const GpLocalizeParams& params,
                                         const std::vector<FieldModel>& fields) {
  GpLocalizeParams p = params;
  if (params.observation_model == ObservationModelType::fitc) {
    p.observation_model = ObservationModelType::online_pitc;
    p.slice_size = 1;
  } else if (params.observation_model != ObservationModelType::online_pitc &&
             params.observation_model != ObservationModelType::online_pitc_assimilated) {
    throw field_core::ParameterError(
        "observation_model", "not offered yet; use online_pitc, online_pitc_assimilated or fitc");
  }
  if (p.map_hypotheses == MapHypotheses::particle) return std::make_unique<ParticleMap>(p, fields);
  return std::make_unique<SamplePathMap>(p, fields);
}

}  // namespace gp_localize
