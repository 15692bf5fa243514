#include "variance_factors.hpp"

#include <algorithm>
#include <cmath>

namespace gp_localize {

VarianceFactors::VarianceFactors(const GpLocalizeParams& params, std::size_t groups)
    : prior_(0.5 * params.variance_dof),
      exponent_(params.likelihood_exponent),
      shape_(groups, prior_),
      next_shape_(shape_),
      readings_(groups) {
  if (!active()) return;
  scale_.resize(params.particles * groups);
  next_scale_.reserve(scale_.size());
  restart();
}

void VarianceFactors::restart() {
  std::fill(shape_.begin(), shape_.end(), prior_);
  std::fill(scale_.begin(), scale_.end(), prior_);
}

void VarianceFactors::begin() {
  if (!active()) return;
  std::fill(readings_.begin(), readings_.end(), 0);
  next_scale_.assign(scale_.begin(), scale_.end());
}

/// The integral over the factor c of N(error; 0, c variance)^e times its posterior so far.
double VarianceFactors::density(std::size_t particle, int group, double error, double& variance) {
  double& b = next_scale_[particle * shape_.size() + group];
  const double a = shape_[group] + 0.5 * exponent_ * (readings_[group] - 1);
  const double after = b + 0.5 * exponent_ * error * error / variance;
  const double log_density =
      -0.5 * std::log(variance * after) - a / exponent_ * std::log(after / b);
  variance *= b / a;
  b = after;
  return log_density;
}

void VarianceFactors::accept() {
  if (!active()) return;
  for (std::size_t g = 0; g < shape_.size(); ++g) shape_[g] += 0.5 * exponent_ * readings_[g];
  scale_.swap(next_scale_);
}

void VarianceFactors::resampled(const std::vector<int>& ancestors) {
  if (!active()) return;
  const std::size_t groups = shape_.size();
  next_scale_.resize(scale_.size());
  for (std::size_t p = 0; p < ancestors.size(); ++p) {
    std::copy_n(scale_.begin() + ancestors[p] * groups, groups, next_scale_.begin() + p * groups);
  }
  scale_.swap(next_scale_);
}

void VarianceFactors::save(field_core::State& state) const {
  if (!active()) return;
  const auto groups = static_cast<Eigen::Index>(shape_.size());
  const auto particles = static_cast<Eigen::Index>(scale_.size()) / groups;
  state.set("variance_factor_shape", Eigen::Map<const Eigen::MatrixXd>(shape_.data(), groups, 1));
  state.set("variance_factor_scale",
            Eigen::Map<const Eigen::MatrixXd>(scale_.data(), groups, particles));
}

void VarianceFactors::restore(const field_core::State& state, const std::vector<int>& ancestors) {
  if (!active()) return;
  if (state.numbers().count("variance_factor_shape") == 0) return restart();
  const auto groups = static_cast<Eigen::Index>(shape_.size());
  const Eigen::MatrixXd& shape = state.matrix("variance_factor_shape", groups, 1);
  const Eigen::MatrixXd& scale = state.matrix("variance_factor_scale", groups, -1);
  std::copy_n(shape.data(), groups, shape_.begin());
  for (std::size_t p = 0; p < ancestors.size(); ++p) {
    std::copy_n(scale.col(ancestors[p]).data(), groups, scale_.begin() + p * groups);
  }
}

}  // namespace gp_localize
