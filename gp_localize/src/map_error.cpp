#include "map_error.hpp"

#include <algorithm>
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
      count_(fields.size(), 0.0),
      standing_(fields.size(), 0.0) {
  for (const FieldModel& field : fields) {
    const auto& kernel = field.basis.kernel();
    const double length = std::sqrt(kernel.length_scales()[0] * kernel.length_scales()[1]);
    memory_.push_back(0.5 * integral(kernel.type()) * length);
  }
}

void MapError::restart() {
  count_.assign(count_.size(), 0.0);
  standing_ = count_;
  moved_ = 0.0;
}

void MapError::move(double distance) {
  constexpr double kMotion = 1e-3;  // m; less may be an encoder between two of its steps
  moved_ += distance;
  if (!active_ || moved_ < kMotion) return;
  for (std::size_t f = 0; f < count_.size(); ++f) {
    count_[f] = (count_[f] + std::min(1.0, standing_[f])) * std::exp(-moved_ / memory_[f]);
    standing_[f] = 0.0;
  }
  moved_ = 0.0;
}

double MapError::power(int field, double map_variance, double noise_variance) const {
  if (!active_) return 1.0;
  const double repeated = 1.0 + 2.0 * (count_[field] + standing_[field]);
  return (noise_variance + map_variance) / (noise_variance + map_variance * repeated);
}

void MapError::save(field_core::State& state) const {
  if (!active_) return;
  Eigen::MatrixXd readings(2, count_.size());
  for (std::size_t f = 0; f < count_.size(); ++f) readings.col(f) << count_[f], standing_[f];
  state.set("readings_near", readings);
  state.set("moved_not_counted", moved_);
}

void MapError::restore(const field_core::State& state) {
  if (!active_) return;
  if (state.numbers().count("readings_near") == 0) return restart();
  const auto fields = static_cast<Eigen::Index>(count_.size());
  const Eigen::MatrixXd& readings = state.matrix("readings_near", 2, fields);
  const double moved = state.scalar("moved_not_counted");
  if (!((readings.array() >= 0.0).all() && moved >= 0.0)) {
    throw field_core::DataError("the state's block 'readings_near' is damaged; make it again");
  }
  for (Eigen::Index f = 0; f < fields; ++f) {
    count_[f] = readings(0, f);
    standing_[f] = readings(1, f);
  }
  moved_ = moved;
}

}  // namespace gp_localize
