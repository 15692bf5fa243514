#include "vector_field_slam/params.hpp"

#include "field_core/errors.hpp"
#include "vector_field_slam/model.hpp"

namespace vector_field_slam {

using field_core::ParameterError;

void VectorFieldSlamParams::validate() const {
  if (channels.empty()) {
    throw ParameterError("channels", "names no channel; give at least one, with its noise_stddev");
  }
  if (channels.size() > kMostChannels) {
    throw ParameterError("channels", "names " + std::to_string(channels.size()) +
                                         " channels; at most " + std::to_string(kMostChannels) +
                                         " are allowed");
  }
  if (relocation == Relocation::window && recovery_rings == 0) {
    throw ParameterError("recovery_rings",
                         "is 0, but relocation: window needs 1 or 2; or use shared_nodes, blank");
  }
  const auto models = make_channels(*this);
  auto model = models.begin();
  for (const auto& [name, p] : channels) {
    if (sensor_model == SensorModelType::beacon_pairs &&
        (model++)->role.kind == ChannelKind::scalar) {
      throw ParameterError("channels/" + name,
                           "sensor_model: beacon_pairs wants names that end in _x or _y");
    }
  }
}

}  // namespace vector_field_slam
