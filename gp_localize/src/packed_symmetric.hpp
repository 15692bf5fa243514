// What one map of a particle costs at each step, on plain arrays and compiled for several
// instruction sets: products and updates of a packed symmetric matrix, and a row of covariances.
// Callers own all memory; nothing here allocates or throws. Packed: the lower triangle by columns.
#pragma once

#include "field_core/kernels.hpp"

namespace gp_localize {

/// y = A x. O(n^2).
void packed_multiply(const double* packed, int n, const double* x, double* y);

/// to = from - sum_k g_k g_k^T over `count` vectors, n numbers each, one after another; `to` may be
/// `from`. O(count n^2).
void packed_downdate(const double* from, int n, int count, const double* g, double* to);

/// What eq. (12)-(13) need of `count` earlier measurements.
struct OpenRows {
  field_core::KernelType kernel;
  const double* prior;          // of each with the field at hand at one place, padded like `place`
  int dimensions;               // d
  const double* length_scales;  // d
  int support;
  int count;
  int stride;           // between the coordinates of a place, a multiple of 4
  const double* place;  // d rows of `count` numbers, padded with finite ones to a multiple of 4
  const double* gain;   // count x support: phi_i - A phi_i
};

/// out[i] = prior_i correlation(place_i, at) - gain_i^T phi; `out` has room for a multiple of 4 and
/// may be `prior`. O(count support).
void open_covariances(const OpenRows& rows, const double* at, const double* phi, double* out);

/// *out = a^T b
void dot_product(const double* a, const double* b, int n, double* out);
inline double dot_product(const double* a, const double* b, int n) {
  double out;
  dot_product(a, b, n, &out);
  return out;
}

}  // namespace gp_localize
