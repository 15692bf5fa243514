#include "map_error.hpp"

#include <cmath>

#include "field_core/errors.hpp"

namespace gp_localize {

// With rho = p(u) exp(-u), u the distance times a: across the line gamma is rho' / d, along it
// rho'', both over rho''(0).
double MapError::integral(field_core::KernelType type) {
  switch (type) {
    case field_core::KernelType::matern32:
      return 1.0 / std::sqrt(3.0);
    case field_core::KernelType::matern52:
      return 49.0 / (24.0 * std::sqrt(5.0));
    default:
      return 0.75 * std::sqrt(M_PI);
  }
}

MapError::MapError(const GpLocalizeParams& params, const std::vector<FieldModel>& fields)
    : active_(params.mode == Mode::localization && params.map_error_correlation),
      count_(fields.size(), 0.0) {
  for (const FieldModel& field : fields) {
    const auto& kernel = field.basis.kernel();
    const double length = std::sqrt(kernel.length_scales()[0] * kernel.length_scales()[1]);
    memory_.push_back(0.5 * integral(kernel.type()) * length);
  }
}

void MapError::restart() { count_.assign(count_.size(), 0.0); }

void MapError::move(double distance) {
  for (std::size_t f = 0; f < count_.size(); ++f) count_[f] *= std::exp(-distance / memory_[f]);
}

double MapError::power(int field, double map_variance, double noise_variance) const {
  if (!active_) return 1.0;
  const double repeated = 1.0 + 2.0 * count_[field];
  return (noise_variance + map_variance) / (noise_variance + map_variance * repeated);
}

void MapError::save(field_core::State& state) const {
  if (!active_) return;
  const auto fields = static_cast<Eigen::Index>(count_.size());
  state.set("readings_near", Eigen::Map<const Eigen::VectorXd>(count_.data(), fields));
}

void MapError::restore(const field_core::State& state) {
  if (!active_) return;
  if (state.numbers().count("readings_near") == 0) return restart();
  const auto fields = static_cast<Eigen::Index>(count_.size());
  const Eigen::MatrixXd& counts = state.matrix("readings_near", fields, 1);
  if (!(counts.array() >= 0.0).all()) {
    throw field_core::DataError("the state's block 'readings_near' is damaged; make it again");
  }
  count_.assign(counts.data(), counts.data() + fields);
}

}  // namespace gp_localize
