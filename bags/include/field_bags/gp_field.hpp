// Fields drawn from a Gaussian process.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>

#include "field_bags/field_source.hpp"
#include "field_core/kernels.hpp"
#include "field_core/params.hpp"

namespace field_bags {

struct GpFieldParams {
  field_core::KernelType kernel = field_core::KernelType::squared_exponential;
  double mean = 0.0;
  double signal_stddev = 1.0;
  std::vector<double> length_scales = {1.0, 1.0};
  double noise_stddev = 0.0;

  template <class Visitor>
  void visit(Visitor& v) {
    using field_core::KernelType;
    using field_core::positive;
    v.choice("kernel", kernel,
             {{"squared_exponential", KernelType::squared_exponential},
              {"matern32", KernelType::matern32},
              {"matern52", KernelType::matern52}},
             "covariance function that the field is drawn from");
    v.required("mean").number("mean", mean, field_core::any_number(), "field unit",
                              "mean of the process");
    v.required("signal_stddev")
        .number("signal_stddev", signal_stddev, positive(), "field unit",
                "standard deviation of the process");
    v.required("length_scales")
        .numbers("length_scales", length_scales, {2, 2}, positive(), "m", "along x and y");
    v.required("noise_stddev")
        .number("noise_stddev", noise_stddev, field_core::non_negative(), "field unit",
                "noise of one reading");
  }
};

/// A zero-mean draw from a stationary kernel by random Fourier features (Rahimi and Recht 2007):
///   f(x) = s / sqrt(M) sum_i [a_i cos(w_i . x) + b_i sin(w_i . x)],  a, b ~ N(0, 1),
/// w drawn from the kernel's spectral density: normal for the squared exponential, multivariate t
/// with 2 nu degrees of freedom for Matern nu (Rasmussen and Williams 2006, eq. 4.15). Over draws,
/// mean and covariance are exactly those of the kernel for any M; with M = 1000 values are Gaussian
/// for all purposes. Smooth everywhere, no grid. O(M) per value.
class GpDraw {
 public:
  GpDraw(const field_core::Kernel& kernel, field_core::Random& random, int features = 1000);
  double operator()(const Eigen::Vector2d& place) const;

 private:
  Eigen::Matrix2Xd frequencies_;
  Eigen::VectorXd cosines_, sines_;
};

/// One channel per field, named as the field.
class GpFields : public FieldSource {
 public:
  GpFields(const std::map<std::string, GpFieldParams>& fields, std::uint64_t seed);
  void append(const field_core::SE2& sensor, std::vector<double>& values) const override;

 private:
  std::vector<double> means_;
  std::vector<GpDraw> draws_;
};

}  // namespace field_bags
