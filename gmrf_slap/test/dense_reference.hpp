// The equations of the paper in the plainest dense form, component by component: what the fast code
// is held against.
#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "field_core/random.hpp"
#include "gmrf_slap/lattice.hpp"

namespace gmrf_slap {
namespace test {

struct DenseGaussian {
  Eigen::VectorXd mean;
  Eigen::MatrixXd sigma;
};

inline Eigen::VectorXd dense_row(const SiteRow& row, int n) {
  Eigen::VectorXd dense = Eigen::VectorXd::Zero(n);
  for (std::size_t i = 0; i < static_cast<std::size_t>(row.count); ++i) {
    dense[row.site[i]] += row.weight[i];
  }
  return dense;
}

/// Eq. (17) for one place.
inline DenseGaussian condition_on(const DenseGaussian& prior, const Eigen::VectorXd& row, double z,
                                  double noise) {
  const Eigen::VectorXd c = prior.sigma * row;
  const double s = row.dot(c) + noise;
  return {prior.mean + c * ((z - row.dot(prior.mean)) / s), prior.sigma - c * c.transpose() / s};
}

/// Eq. (15)-(16): total mean and variance of the components.
inline DenseGaussian moments(const std::vector<DenseGaussian>& components,
                             const std::vector<double>& weights) {
  DenseGaussian out{Eigen::VectorXd::Zero(components[0].mean.size()),
                    Eigen::MatrixXd::Zero(components[0].mean.size(), components[0].mean.size())};
  for (std::size_t k = 0; k < components.size(); ++k) out.mean += weights[k] * components[k].mean;
  for (std::size_t k = 0; k < components.size(); ++k) {
    const Eigen::VectorXd d = components[k].mean - out.mean;
    out.sigma += weights[k] * (components[k].sigma + d * d.transpose());
  }
  return out;
}

inline double normal_density(double x, double mean, double variance) {
  const double d = x - mean;
  return std::exp(-0.5 * d * d / variance) / std::sqrt(2.0 * M_PI * variance);
}

/// A draw of the field itself.
inline Eigen::VectorXd draw_field(const Eigen::MatrixXd& sigma, field_core::Random& random) {
  Eigen::VectorXd white(sigma.rows());
  for (Eigen::Index i = 0; i < white.size(); ++i) white[i] = random.normal();
  return Eigen::LLT<Eigen::MatrixXd>(sigma).matrixL() * white;
}

}  // namespace test
}  // namespace gmrf_slap
