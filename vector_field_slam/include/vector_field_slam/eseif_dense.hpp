// Small dense symmetric systems for the embedded filter: A = U^T U, upper triangles, row-major with
// a stride. Inner loops run along rows, so that compilers vectorize them. No heap, no exceptions.
#pragma once

#include <cmath>

namespace vector_field_slam {
namespace dense {

/// Eliminates the first `steps` of `n` variables in place: their rows become those of U, the rest
/// the Schur complement, i.e. the information of the remaining variables with these marginalized
/// out. steps = n: Cholesky. O(steps n^2). @return false if a pivot is not positive
template <class S>
bool eliminate(S* a, int n, int stride, int steps) {
  for (int k = 0; k < steps; ++k) {
    S* const row = a + k * stride;
    if (!(row[k] > S(0))) return false;
    const S inverse = S(1) / std::sqrt(row[k]);
    for (int j = k; j < n; ++j) row[j] *= inverse;
    for (int i = k + 1; i < n; ++i) {
      const S f = row[i];
      if (f == S(0)) continue;  // nodes that are no neighbours
      S* const other = a + i * stride;
      for (int j = i; j < n; ++j) other[j] -= f * row[j];
    }
  }
  return true;
}

/// b := U^-T b for n rows of `columns` numbers. O(n^2 columns)
template <class S>
void forward(const S* u, int n, int stride, S* b, int columns, int b_stride) {
  for (int k = 0; k < n; ++k) {
    S* const row = b + k * b_stride;
    const S inverse = S(1) / u[k * stride + k];
    for (int c = 0; c < columns; ++c) row[c] *= inverse;
    for (int j = k + 1; j < n; ++j) {
      const S f = u[k * stride + j];
      if (f == S(0)) continue;
      S* const other = b + j * b_stride;
      for (int c = 0; c < columns; ++c) other[c] -= f * row[c];
    }
  }
}

/// b := U^-T b for one vector. O(n^2)
template <class S>
void forward(const S* u, int n, int stride, S* b) {
  for (int k = 0; k < n; ++k) {
    const S* const row = u + k * stride;
    const S x = b[k] / row[k];
    b[k] = x;
    for (int j = k + 1; j < n; ++j) b[j] -= row[j] * x;
  }
}

/// b := U^-1 b for one vector. O(n^2)
template <class S>
void backward(const S* u, int n, int stride, S* b) {
  for (int k = n - 1; k >= 0; --k) {
    const S* const row = u + k * stride;
    S sum = b[k];
    for (int j = k + 1; j < n; ++j) sum -= row[j] * b[j];
    b[k] = sum / row[k];
  }
}

/// inverse := a^-1, full and symmetric; a (upper, stride N) is overwritten. O(N^3)
template <class S, int N>
bool invert(S* a, S* inverse) {
  if (!eliminate(a, N, N, N)) return false;
  for (int i = 0; i < N; ++i) {
    S column[N] = {};
    column[i] = S(1);
    forward(a, N, N, column);
    backward(a, N, N, column);
    for (int j = 0; j <= i; ++j) inverse[i * N + j] = inverse[j * N + i] = column[j];
  }
  return true;
}

}  // namespace dense
}  // namespace vector_field_slam
