// The log marginal likelihood of a field's measurements under a Gaussian process, with its
// gradient: exact, and in the PITC approximation that the filter itself uses.
//
// Notation: z the n measurements at known places, mu the constant mean, theta = (mu, log sigma_s,
// log sigma_n, log l_1 .. log l_d), Sigma the covariance of z, alpha = Sigma^-1 (z - mu). Then
//   log p(z) = -1/2 ((z - mu)^T alpha + log |Sigma| + n log 2 pi)
//   d log p / d theta_i = <G, d Sigma / d theta_i>,   G = (alpha alpha^T - Sigma^-1) / 2
// (Rasmussen and Williams 2006, eq. 5.8-5.9); d log p / d mu = 1^T alpha. Of a group of correlated
// fields z are the measurements of all of them, Sigma_ij = B_f(i)f(j) k(x_i, x_j) plus the noise of
// field f(i) on the diagonal, and theta is that of group_theta.hpp.
//
// PITC with support u and slices b (Quinonero-Candela and Rasmussen 2005, eq. 30):
//   Sigma = Gamma + blockdiag(Lambda_b),  Gamma = K_fu K_uu^-1 K_uf,
//   Lambda_b = K_bb - Gamma_bb + sigma_n^2 I
// Inside a slice Sigma is exact, so with W = K_uu^-1 K_uf and G0 = G without its diagonal blocks
//   <G, d Sigma> = sum_b <G_b, d K_bb + d sigma_n^2 I> + 2 <W G0, d K_uf> - <W G0 W^T, d K_uu>.
#pragma once

#include <Eigen/Core>

#include "field_core/kernels.hpp"
#include "gp_localize/group_theta.hpp"
#include "gp_localize/survey.hpp"

namespace gp_localize {

/// What maximum likelihood finds. Units: of the field, and of places.
struct Hyperparameters {
  double mean = 0.0;
  double signal_stddev = 1.0;
  double noise_stddev = 0.1;
  field_core::Place length_scales = Eigen::Vector2d(1.0, 1.0);
};

/// Of a single field: (mean, log signal_stddev, log noise_stddev, log length scales), 3 + d
/// numbers.
Theta to_theta(const Hyperparameters& h);
Hyperparameters from_theta(const Theta& theta);

class MarginalLikelihood {
 public:
  virtual ~MarginalLikelihood() = default;
  /// log p(z), and its gradient where wanted.
  /// @throws NumericalError if the covariance is singular at `theta`
  virtual double operator()(const Theta& theta, Theta* gradient) const = 0;
};

/// Exact. O(n^3) per evaluation, O(n^2) memory. `survey` must outlive it; with several `fields` its
/// places are of d + 1 coordinates, the last the number of the field (merge()).
class FullLikelihood final : public MarginalLikelihood {
 public:
  FullLikelihood(field_core::KernelType kernel, const FieldSurvey& survey, int fields = 1)
      : kernel_(kernel), survey_(survey), fields_(fields) {}
  double operator()(const Theta& theta, Theta* gradient) const override;

 private:
  field_core::KernelType kernel_;
  const FieldSurvey& survey_;
  int fields_;
};

/// PITC in slices of consecutive measurements. O(n (m^2 + slice_size^2)) per evaluation.
class PitcLikelihood final : public MarginalLikelihood {
 public:
  /// @param support as the survey's places, distinct
  /// @param jitter share of the signal variance added to the diagonal of K_uu
  PitcLikelihood(field_core::KernelType kernel, const FieldSurvey& survey,
                 const field_core::Places& support, int slice_size, double jitter = 1e-6,
                 int fields = 1)
      : kernel_(kernel),
        survey_(survey),
        support_(support),
        slice_size_(slice_size),
        jitter_(jitter),
        fields_(fields) {}
  double operator()(const Theta& theta, Theta* gradient) const override;

 private:
  field_core::KernelType kernel_;
  const FieldSurvey& survey_;
  field_core::Places support_;
  int slice_size_;
  double jitter_;
  int fields_;
};

}  // namespace gp_localize
