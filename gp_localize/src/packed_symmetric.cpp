#include "packed_symmetric.hpp"

#include "vector_math.hpp"

namespace gp_localize {
namespace {

using field_core::KernelType;

template <int Bytes>
struct PackedKernels {
  using M = VectorMath<double, Bytes>;
  using Vector = typename M::Vector;
  static constexpr int kLanes = M::kLanes;

  static GP_LOCALIZE_INLINE double dot_product(const double* a, const double* b, int n) {
    Vector sums{};
    int i = 0;
    for (; i + kLanes <= n; i += kLanes) sums += M::load(a + i) * M::load(b + i);
    double sum = M::sum(sums);
    for (; i < n; ++i) sum += a[i] * b[i];
    return sum;
  }

  /// Columns j .. j + 3, below their diagonal block: read and written once for all four.
  static GP_LOCALIZE_INLINE void multiply_block(const double* const (&a)[4], int rows,
                                                const double (&xj)[4], const double* x, double* y,
                                                double (&dots)[4]) {
    Vector sums[4]{};
    int i = 0;
    for (; i + kLanes <= rows; i += kLanes) {
      const Vector xi = M::load(x + i);
      Vector yi = M::load(y + i);
#pragma GCC unroll 4
      for (int c = 0; c < 4; ++c) {
        const Vector column = M::load(a[c] + i);
        yi += column * xj[c];
        sums[c] += column * xi;
      }
      M::store(y + i, yi);
    }
    for (int c = 0; c < 4; ++c) dots[c] = M::sum(sums[c]);
    for (; i < rows; ++i) {
      for (int c = 0; c < 4; ++c) {
        y[i] += a[c][i] * xj[c];
        dots[c] += a[c][i] * x[i];
      }
    }
  }

  static GP_LOCALIZE_INLINE void multiply(const double* packed, int n, const double* x, double* y) {
    for (int i = 0; i < n; ++i) y[i] = 0.0;
    int j = 0;
    for (; j + 4 <= n; j += 4) {
      const double* column[4];
      for (int c = 0; c < 4; packed += n - j - c, ++c) column[c] = packed;
      const double xj[4] = {x[j], x[j + 1], x[j + 2], x[j + 3]};
      for (int c = 0; c < 4; ++c) {  // the diagonal block
        y[j + c] += column[c][0] * xj[c];
        for (int r = c + 1; r < 4; ++r) {
          y[j + r] += column[c][r - c] * xj[c];
          y[j + c] += column[c][r - c] * xj[r];
        }
        column[c] += 4 - c;
      }
      double dots[4];
      multiply_block({column[0], column[1], column[2], column[3]}, n - j - 4, xj, x + j + 4,
                     y + j + 4, dots);
      for (int c = 0; c < 4; ++c) y[j + c] += dots[c];
    }
    for (; j < n; packed += n - j, ++j) {
      y[j] += packed[0] * x[j];
      for (int i = j + 1; i < n; ++i) {
        y[i] += packed[i - j] * x[j];
        y[j] += packed[i - j] * x[i];
      }
    }
  }

  static GP_LOCALIZE_INLINE void downdate(const double* from, int n, int count, const double* g,
                                          double* to) {
    for (int j = 0; j < n; from += n - j, to += n - j, ++j) {
      int i = 0;
      for (; i + kLanes <= n - j; i += kLanes) {
        Vector a = M::load(from + i);
        const double* gk = g + j;
        for (int k = 0; k < count; ++k, gk += n) a -= M::load(gk + i) * gk[0];
        M::store(to + i, a);
      }
      for (; i < n - j; ++i) {
        double a = from[i];
        for (int k = 0; k < count; ++k) a -= g[k * n + j + i] * g[k * n + j];
        to[i] = a;
      }
    }
  }

  static GP_LOCALIZE_INLINE Vector correlation(KernelType type, Vector r2) {
    if (type == KernelType::squared_exponential) return M::exp_of_negative(r2 * -0.5);
    const bool smooth = type == KernelType::matern52;
    const Vector r = M::square_root(r2 * (smooth ? 5.0 : 3.0));
    const Vector decay = M::exp_of_negative(-r);
    return smooth ? (1.0 + r + r * r * (1.0 / 3.0)) * decay : (1.0 + r) * decay;
  }

  static GP_LOCALIZE_INLINE void covariances(const OpenRows& rows, double x, double y,
                                             const double* phi, double* out) {
    for (int i = 0; i < rows.count; i += kLanes) {
      const Vector dx = (M::load(rows.x + i) - x) / rows.length_x;
      const Vector dy = (M::load(rows.y + i) - y) / rows.length_y;
      M::store(out + i, rows.signal_variance * correlation(rows.kernel, dx * dx + dy * dy));
    }
    const double* gain = rows.gain;
    for (int i = 0; i < rows.count; ++i, gain += rows.support) {
      out[i] -= dot_product(gain, phi, rows.support);
    }
  }
};

#if defined(__x86_64__)
#define GP_LOCALIZE_WIDE __attribute__((target("avx2,fma")))
bool wide_supported() { return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"); }
using Wide = PackedKernels<32>;
#else
#define GP_LOCALIZE_WIDE
bool wide_supported() { return false; }
using Wide = PackedKernels<16>;
#endif
using Narrow = PackedKernels<16>;

bool use_wide = wide_supported();

GP_LOCALIZE_WIDE void multiply_wide(const double* packed, int n, const double* x, double* y) {
  Wide::multiply(packed, n, x, y);
}
GP_LOCALIZE_WIDE void downdate_wide(const double* from, int n, int count, const double* g,
                                    double* to) {
  Wide::downdate(from, n, count, g, to);
}
GP_LOCALIZE_WIDE void covariances_wide(const OpenRows& rows, double x, double y, const double* phi,
                                       double* out) {
  Wide::covariances(rows, x, y, phi, out);
}
GP_LOCALIZE_WIDE double dot_wide(const double* a, const double* b, int n) {
  return Wide::dot_product(a, b, n);
}

}  // namespace

bool use_wide_packed(bool wanted) { return use_wide = wanted && wide_supported(); }

void packed_multiply(const double* packed, int n, const double* x, double* y) {
  use_wide ? multiply_wide(packed, n, x, y) : Narrow::multiply(packed, n, x, y);
}

void packed_downdate(const double* from, int n, int count, const double* g, double* to) {
  use_wide ? downdate_wide(from, n, count, g, to) : Narrow::downdate(from, n, count, g, to);
}

void open_covariances(const OpenRows& rows, double x, double y, const double* phi, double* out) {
  use_wide ? covariances_wide(rows, x, y, phi, out) : Narrow::covariances(rows, x, y, phi, out);
}

double dot_product(const double* a, const double* b, int n) {
  return use_wide ? dot_wide(a, b, n) : Narrow::dot_product(a, b, n);
}

}  // namespace gp_localize
