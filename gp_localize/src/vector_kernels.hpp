// Hot loops on plain arrays that all maps share, compiled for several instruction sets. Callers own
// all memory; nothing here allocates or throws.
#pragma once

#include "field_core/kernels.hpp"

namespace gp_localize {

constexpr int kMaxSupport = 400;

struct WhitenedSupport {
  field_core::KernelType kernel;
  double signal_variance;
  int dimensions;               // d
  const double* length_scales;  // d
  int size;                     // m
  const double* support;        // m places, d numbers each
  const double* whitening;      // m x m, row-major, lower triangular
};

/// features (m x n, row-major) = whitening * k(support, points); points: d numbers each, `stride`
/// numbers apart.
void whitened_features(const WhitenedSupport& basis, int n, const double* points, int stride,
                       double* features);

/// out[p] = log of the mean over the first `hypotheses` numbers of row p of exp(rows), rows
/// `stride` apart.
void log_mean_exp(const float* rows, int count, int hypotheses, int stride, double* out);
void log_mean_exp(const double* rows, int count, int hypotheses, int stride, double* out);

}  // namespace gp_localize
