#include "field_bags/gp_field.hpp"

#include <cmath>

namespace field_bags {
namespace {

/// Degrees of freedom of the spectral density's multivariate t; 0: normal.
int spectral_degrees(field_core::KernelType type) {
  if (type == field_core::KernelType::matern32) return 3;
  if (type == field_core::KernelType::matern52) return 5;
  return 0;
}

Eigen::Vector2d draw_frequency(int degrees, field_core::Random& random) {
  const double x = random.normal();
  Eigen::Vector2d frequency(x, random.normal());
  if (degrees == 0) return frequency;
  double chi_squared = 0.0;
  for (int i = 0; i < degrees; ++i) {
    const double n = random.normal();
    chi_squared += n * n;
  }
  return frequency * std::sqrt(degrees / chi_squared);
}

}  // namespace

GpDraw::GpDraw(const field_core::Kernel& kernel, field_core::Random& random, int features)
    : frequencies_(2, features), cosines_(features), sines_(features) {
  const int degrees = spectral_degrees(kernel.type());
  const double amplitude = std::sqrt(kernel.signal_variance() / features);
  for (int i = 0; i < features; ++i) {
    frequencies_.col(i) = draw_frequency(degrees, random).cwiseQuotient(kernel.length_scales());
    cosines_[i] = amplitude * random.normal();
    sines_[i] = amplitude * random.normal();
  }
}

double GpDraw::operator()(const Eigen::Vector2d& place) const {
  double value = 0.0;
  for (Eigen::Index i = 0; i < cosines_.size(); ++i) {
    const double phase = frequencies_(0, i) * place.x() + frequencies_(1, i) * place.y();
    value += cosines_[i] * std::cos(phase) + sines_[i] * std::sin(phase);
  }
  return value;
}

GpFields::GpFields(const std::map<std::string, GpFieldParams>& fields, std::uint64_t seed) {
  for (const auto& [name, field] : fields) {
    channels_.push_back({name, field.noise_stddev});
    means_.push_back(field.mean);
    const field_core::Kernel kernel(field.kernel, field.signal_stddev,
                                    {field.length_scales[0], field.length_scales[1]});
    field_core::Random random = random_stream(seed, "gp_fields/" + name);
    draws_.emplace_back(kernel, random);
  }
}

void GpFields::append(const field_core::SE2& sensor, std::vector<double>& values) const {
  for (std::size_t i = 0; i < draws_.size(); ++i) {
    values.push_back(means_[i] + draws_[i](sensor.translation()));
  }
}

}  // namespace field_bags
