#include "packed_symmetric.hpp"

#include "instruction_sets.hpp"
#include "vector_math.hpp"

namespace gp_localize {
namespace {

template <class T, int Bytes>
struct Kernels {
  using M = VectorMath<T, Bytes>;
  using Vector = typename M::Vector;
  static constexpr int kLanes = M::kLanes;

  static GP_LOCALIZE_INLINE double dot(const double* a, const double* b, int n) {
    Vector sums{};
    int i = 0;
    for (; i + kLanes <= n; i += kLanes) sums += M::load(a + i) * M::load(b + i);
    double sum = M::sum(sums);
    for (; i < n; ++i) sum += a[i] * b[i];
    return sum;
  }

  static GP_LOCALIZE_INLINE void dot_product(const double* a, const double* b, int n, double* out) {
    *out = dot(a, b, n);
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

  static GP_LOCALIZE_INLINE void packed_multiply(const double* packed, int n, const double* x,
                                                 double* y) {
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

  static GP_LOCALIZE_INLINE void packed_downdate(const double* from, int n, int count,
                                                 const double* g, double* to) {
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

  static GP_LOCALIZE_INLINE void open_covariances(const OpenRows& rows, const double* at,
                                                  const double* phi, double* out) {
    for (int i = 0; i < rows.count; i += kLanes) {
      const Vector r2 = squared_distance<M>(rows.dimensions, [&](int a) GP_LOCALIZE_INLINE_LAMBDA {
        return (M::load(rows.place + a * rows.stride + i) - at[a]) / rows.length_scales[a];
      });
      M::store(out + i, M::load(rows.prior + i) * correlation<M>(rows.kernel, r2));
    }
    const double* gain = rows.gain;
    for (int i = 0; i < rows.count; ++i, gain += rows.support) {
      out[i] -= dot(gain, phi, rows.support);
    }
  }
};

}  // namespace

GP_LOCALIZE_KERNEL(packed_multiply, double,
                   (const double* packed, int n, const double* x, double* y), (packed, n, x, y))
GP_LOCALIZE_KERNEL(packed_downdate, double,
                   (const double* from, int n, int count, const double* g, double* to),
                   (from, n, count, g, to))
GP_LOCALIZE_KERNEL(open_covariances, double,
                   (const OpenRows& rows, const double* at, const double* phi, double* out),
                   (rows, at, phi, out))
GP_LOCALIZE_KERNEL(dot_product, double, (const double* a, const double* b, int n, double* out),
                   (a, b, n, out))

}  // namespace gp_localize
