#include "hypothesis_kernels.hpp"

#include <algorithm>
#include <cmath>

#include "vector_math.hpp"

namespace gp_localize {
namespace {

using field_core::KernelType;
constexpr int kGroup = 10;  // tiles of particles that share a panel while it is in the cache
constexpr int kMaxSlice = 100;
constexpr int kMaxSupport = 400;

template <class T, int Bytes>
struct Kernels {
  using M = VectorMath<T, Bytes>;
  using Vector = typename M::Vector;
  static constexpr int kLanes = M::kLanes;
  static constexpr int kWidth = kPanel<T>;
  static constexpr int kParts = kWidth / kLanes;
  // Particles of one register tile: kRows x kParts accumulators leave room in 16 registers.
  static constexpr int kRows = 12 / kParts;

  static GP_LOCALIZE_INLINE Vector correlation(KernelType type, Vector r2) {
    if (type == KernelType::squared_exponential) return M::exp_of_negative(r2 * T(-0.5));
    const bool smooth = type == KernelType::matern52;
    const Vector r = M::square_root(r2 * (smooth ? T(5) : T(3)));
    const Vector decay = M::exp_of_negative(-r);
    return smooth ? (T(1) + r + r * r * T(1.0 / 3.0)) * decay : (T(1) + r) * decay;
  }

  static GP_LOCALIZE_INLINE void whitened_features(const WhitenedSupport& b, int n,
                                                   const double* points, int stride,
                                                   double* features) {
    alignas(64) T column[kMaxSupport][kWidth];
    for (int begin = 0; begin < n; begin += kWidth) {
      const int count = std::min(kWidth, n - begin);
      alignas(64) T px[kWidth], py[kWidth];
      for (int l = 0; l < kWidth; ++l) {
        const double* p = points + static_cast<long>(begin + std::min(l, count - 1)) * stride;
        px[l] = p[0];
        py[l] = p[1];
      }
      for (int i = 0; i < b.size; ++i) {
        for (int h = 0; h < kWidth; h += kLanes) {
          const Vector dx = (M::load(px + h) - b.support[2 * i]) / b.length_x;
          const Vector dy = (M::load(py + h) - b.support[2 * i + 1]) / b.length_y;
          M::store(&column[i][h], b.signal_variance * correlation(b.kernel, dx * dx + dy * dy));
        }
      }
      for (int i = b.size - 1; i >= 0; --i) {
        const T* w = b.whitening + static_cast<long>(i) * b.size;
        Vector sums[kParts]{};
        for (int k = 0; k <= i; ++k) {
          for (int h = 0; h < kParts; ++h) sums[h] += w[k] * M::load(&column[k][h * kLanes]);
        }
        alignas(64) T row[kWidth];
        for (int h = 0; h < kParts; ++h) M::store(row + h * kLanes, sums[h]);
        std::copy(row, row + count, features + static_cast<long>(i) * n + begin);
      }
    }
  }

  /// sums[r] += sum_k rows[k][r] * panel[k]: a tile of particles against one panel of hypotheses.
  static GP_LOCALIZE_INLINE void multiply_tile(const T* rows, const T* panel, int k_end,
                                               Vector (&sums)[kRows][kParts]) {
    Vector acc[kRows][kParts]{};
    for (int k = 0; k < k_end; ++k, rows += kRows, panel += kWidth) {
      Vector column[kParts];
#pragma GCC unroll 4
      for (int h = 0; h < kParts; ++h) column[h] = M::load(panel + h * kLanes);
#pragma GCC unroll 6
      for (int r = 0; r < kRows; ++r) {
#pragma GCC unroll 4
        for (int h = 0; h < kParts; ++h) acc[r][h] += rows[r] * column[h];
      }
    }
#pragma GCC unroll 6
    for (int r = 0; r < kRows; ++r) {
#pragma GCC unroll 4
      for (int h = 0; h < kParts; ++h) sums[r][h] = acc[r][h];
    }
  }

  /// A tile's features (interleaved by particle), and their products weighted so that a dot product
  /// with a packed symmetric matrix A is phi^T A phi.
  static GP_LOCALIZE_INLINE void prepare_tile(const ParticleBatch<T>& b, int support, int first,
                                              T* phi, T* products) {
    for (int k = 0; k < support; ++k) {
      const T* row = b.features + static_cast<long>(k) * b.stride;
      for (int r = 0; r < kRows; ++r) phi[k * kRows + r] = row[std::min(first + r, b.count - 1)];
    }
    for (int j = 0; j < support; ++j) {
      for (int i = j; i < support; ++i, products += kRows) {
        const T factor = i == j ? T(1) : T(2);
        for (int r = 0; r < kRows; ++r) {
          products[r] = factor * phi[i * kRows + r] * phi[j * kRows + r];
        }
      }
    }
  }

  /// Conditions the tile's predictions on the open slice: eq. (12)-(13).
  static GP_LOCALIZE_INLINE void condition_on_open_slice(const HypothesisPanels<T>& b,
                                                         const ParticleBatch<T>& batch, int panel,
                                                         int first, const T* phi,
                                                         Vector (&mean)[kRows][kParts],
                                                         Vector (&variance)[kRows][kParts]) {
    const long slot = static_cast<long>(panel) * b.slice_size;
    Vector q[kMaxSlice][kRows][kParts];
    for (int i = 0; i < b.open; ++i) {
      Vector explained[kRows][kParts];
      multiply_tile(phi, b.open_gain + (slot + i) * b.support * kWidth, b.support, explained);
      const T* factor = b.open_factor + (slot + i) * b.slice_size * kWidth;
      for (int h = 0; h < kParts; ++h) {
        const long at = (slot + i) * kWidth + h * kLanes;
        const Vector ox = M::load(b.open_x + at), oy = M::load(b.open_y + at);
        const Vector value = M::load(b.open_value + at);
        for (int r = 0; r < kRows; ++r) {
          const int p = std::min(first + r, batch.count - 1);
          const Vector dx = ox - batch.x[p], dy = oy - batch.y[p];
          Vector rest =
              b.signal_variance * correlation(b.kernel, dx * dx + dy * dy) - explained[r][h];
          for (int j = 0; j < i; ++j)
            rest -= M::load(factor + j * kWidth + h * kLanes) * q[j][r][h];
          rest *= M::load(factor + i * kWidth + h * kLanes);
          q[i][r][h] = rest;
          mean[r][h] += rest * value;
          variance[r][h] -= rest * rest;
        }
      }
    }
  }

  static GP_LOCALIZE_INLINE void write_tile(const HypothesisPanels<T>& b,
                                            const ParticleBatch<T>& batch, int panel, int first,
                                            const Vector (&mean)[kRows][kParts],
                                            const Vector (&variance)[kRows][kParts]) {
    for (int r = 0; r < kRows && first + r < batch.count; ++r) {
      Vector means{}, squares{};
      for (int h = 0; h < kParts; ++h) {
        const Vector v = variance[r][h], m = mean[r][h];
        const Vector counted = M::load(b.weight + panel * kWidth + h * kLanes);
        means += counted * m;
        squares += counted * (v + m * m);
        if (!batch.log_density) continue;
        T* out = batch.log_density + (static_cast<long>(first + r) * b.panels + panel) * kWidth;
        const Vector error = batch.value - m;
        const Vector term = T(-0.5) * (error * error / v + M::log_of_positive(v));
        M::store(out + h * kLanes, M::load(out + h * kLanes) + term);
      }
      T* moments = batch.moments + 2 * (first + r);
      moments[0] += M::sum(means);
      moments[1] += M::sum(squares);
    }
  }

  static GP_LOCALIZE_INLINE void add_log_densities(const HypothesisPanels<T>& b,
                                                   const ParticleBatch<T>& batch) {
    const int packed = b.support * (b.support + 1) / 2;
    const long tile_size = static_cast<long>(kRows) * (packed + b.support);
    std::fill(batch.moments, batch.moments + 2 * batch.count, T(0));
    for (int group = 0; group < batch.count; group += kRows * kGroup) {
      const int tiles = std::min(kGroup, (batch.count - group + kRows - 1) / kRows);
      for (int t = 0; t < tiles; ++t) {
        T* phi = batch.scratch + t * tile_size;
        prepare_tile(batch, b.support, group + t * kRows, phi, phi + kRows * b.support);
      }
      for (int panel = 0; panel < b.panels; ++panel) {
        const T* means = b.mean + static_cast<long>(panel) * b.support * kWidth;
        const T* covariances = b.covariance + static_cast<long>(panel) * packed * kWidth;
        for (int t = 0; t < tiles; ++t) {
          const int first = group + t * kRows;
          const T* phi = batch.scratch + t * tile_size;
          Vector mean[kRows][kParts], variance[kRows][kParts];
          multiply_tile(phi, means, b.support, mean);
          multiply_tile(phi + kRows * b.support, covariances, packed, variance);
          for (int r = 0; r < kRows; ++r) {
            const T rest = batch.residual[std::min(first + r, batch.count - 1)];
            for (int h = 0; h < kParts; ++h) variance[r][h] += rest;
          }
          condition_on_open_slice(b, batch, panel, first, phi, mean, variance);
          write_tile(b, batch, panel, first, mean, variance);
        }
      }
    }
  }

  /// phi - A phi and m^T phi for one vector of hypotheses.
  static GP_LOCALIZE_INLINE void open_gain(const HypothesisPanels<T>& b, int panel, int half,
                                           const Vector* phi, T* gain, Vector& mean) {
    const int m = b.support;
    const T* a =
        b.covariance + static_cast<long>(panel) * (m * (m + 1) / 2) * kWidth + half * kLanes;
    const T* weights = b.mean + static_cast<long>(panel) * m * kWidth + half * kLanes;
    mean = Vector{};
    for (int k = 0; k < m; ++k) {
      M::store(gain + k * kWidth, phi[k]);
      mean += phi[k] * M::load(weights + k * kWidth);
    }
    for (int j = 0; j < m; ++j) {
      Vector column = M::load(a) * phi[j];
      a += kWidth;
      for (int i = j + 1; i < m; ++i, a += kWidth) {
        const Vector aij = M::load(a);
        M::store(gain + i * kWidth, M::load(gain + i * kWidth) - aij * phi[j]);
        column += aij * phi[i];
      }
      M::store(gain + j * kWidth, M::load(gain + j * kWidth) - column);
    }
  }

  static GP_LOCALIZE_INLINE void extend_open_slice(HypothesisPanels<T>& b, const OpenRow<T>& row) {
    const int last = b.open;
    const long stride = static_cast<long>(b.panels) * kWidth;
    Vector phi[kMaxSupport], covariance[kMaxSlice];
    for (int panel = 0; panel < b.panels; ++panel) {
      const long slot = static_cast<long>(panel) * b.slice_size;
      for (int half = 0; half < kParts; ++half) {
        const long c = panel * kWidth + half * kLanes;
        const auto lane = [&](T* array, long index) {
          return array + index * kWidth + half * kLanes;
        };
        for (int k = 0; k < b.support; ++k) phi[k] = M::load(row.features + k * stride + c);
        Vector prediction;
        T* gain = lane(b.open_gain, (slot + last) * b.support);
        open_gain(b, panel, half, phi, gain, prediction);
        const Vector x = M::load(row.x + c), y = M::load(row.y + c);
        M::store(lane(b.open_x, slot + last), x);
        M::store(lane(b.open_y, slot + last), y);
        Vector value = row.value - prediction;
        Vector variance = M::broadcast(row.noise_variance);
        for (int j = 0; j <= last; ++j) {
          const Vector dx = M::load(lane(b.open_x, slot + j)) - x;
          const Vector dy = M::load(lane(b.open_y, slot + j)) - y;
          Vector rest = b.signal_variance * correlation(b.kernel, dx * dx + dy * dy);
          const T* known = lane(b.open_gain, (slot + j) * b.support);
          for (int k = 0; k < b.support; ++k) rest -= phi[k] * M::load(known + k * kWidth);
          if (j == last) {
            variance += rest;
            break;
          }
          const long factor = (slot + j) * b.slice_size;
          for (int i = 0; i < j; ++i)
            rest -= M::load(lane(b.open_factor, factor + i)) * covariance[i];
          rest *= M::load(lane(b.open_factor, factor + j));
          covariance[j] = rest;
          M::store(lane(b.open_factor, (slot + last) * b.slice_size + j), rest);
          value -= rest * M::load(lane(b.open_value, slot + j));
          variance -= rest * rest;
        }
        const Vector inverse = T(1) / M::square_root(variance);
        M::store(lane(b.open_factor, (slot + last) * b.slice_size + last), inverse);
        M::store(lane(b.open_value, slot + last), value * inverse);
      }
    }
    ++b.open;
  }

  static GP_LOCALIZE_INLINE void log_mean_exp(const T* rows, int count, int hypotheses, int stride,
                                              double* out) {
    for (int p = 0; p < count; ++p, rows += stride) {
      const T largest = *std::max_element(rows, rows + hypotheses);
      Vector sums{};
      int c = 0;
      for (; c + kLanes <= hypotheses; c += kLanes) {
        sums += M::exp_of_negative(M::load(rows + c) - largest);
      }
      double total = M::sum(sums);
      for (; c < hypotheses; ++c) total += std::exp(static_cast<double>(rows[c] - largest));
      out[p] = static_cast<double>(largest) + std::log(total / hypotheses);
    }
  }
  static GP_LOCALIZE_INLINE void symmetric_multiply(const T* packed, int n, const T* x, T* y) {
    std::fill(y, y + n, T(0));
    for (int j = 0; j < n; ++j) {
      const int below = n - j - 1;
      const T* a = packed + 1;
      const T* xs = x + j + 1;
      T* ys = y + j + 1;
      Vector dots{};
      int i = 0;
      for (; i + kLanes <= below; i += kLanes) {
        const Vector column = M::load(a + i);
        M::store(ys + i, M::load(ys + i) + column * x[j]);
        dots += column * M::load(xs + i);
      }
      T dot = M::sum(dots);
      for (; i < below; ++i) {
        ys[i] += a[i] * x[j];
        dot += a[i] * xs[i];
      }
      y[j] += packed[0] * x[j] + dot;
      packed += n - j;
    }
  }

  static GP_LOCALIZE_INLINE void symmetric_downdate(T* packed, int n, T scale, const T* g) {
    for (int j = 0; j < n; ++j) {
      const T s = scale * g[j];
      int i = 0;
      for (; i + kLanes <= n - j; i += kLanes) {
        M::store(packed + i, M::load(packed + i) - s * M::load(g + j + i));
      }
      for (; i < n - j; ++i) packed[i] -= s * g[j + i];
      packed += n - j;
    }
  }
};

}  // namespace

int scratch_size(int support) {
  // For the widest tile of any version.
  return kGroup * 6 * (support * (support + 1) / 2 + support);
}

// One binary for all machines: on x86-64 each kernel is compiled twice, for AVX2 with FMA
// (x86-64-v3) and for the baseline, and a flag read once from the processor chooses. Elsewhere one
// version, with the vectors that every machine of that kind has (NEON on 64-bit ARM). Results
// differ between the versions in the last bits only, but they differ: the same bits need the same
// kind of processor.
namespace {

#if defined(__x86_64__)
#define GP_LOCALIZE_WIDE __attribute__((target("avx2,fma")))
bool wide_vectors_supported() {
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
}
constexpr int kWideBytes = 32;
#else
#define GP_LOCALIZE_WIDE
bool wide_vectors_supported() { return false; }
constexpr int kWideBytes = 16;
#endif

bool use_wide = wide_vectors_supported();

}  // namespace

bool use_wide_vectors(bool wanted) { return use_wide = wanted && wide_vectors_supported(); }

#define GP_LOCALIZE_KERNEL(name, T, parameters, arguments)                                 \
  namespace {                                                                              \
  GP_LOCALIZE_WIDE void name##_wide parameters { Kernels<T, kWideBytes>::name arguments; } \
  void name##_narrow parameters { Kernels<T, 16>::name arguments; }                        \
  }                                                                                        \
  void name parameters {                                                                   \
    if (use_wide) {                                                                        \
      name##_wide arguments;                                                               \
    } else {                                                                               \
      name##_narrow arguments;                                                             \
    }                                                                                      \
  }

GP_LOCALIZE_KERNEL(whitened_features, double,
                   (const WhitenedSupport& basis, int n, const double* points, int stride,
                    double* features),
                   (basis, n, points, stride, features))
GP_LOCALIZE_KERNEL(add_log_densities, float,
                   (const HypothesisPanels<float>& panels, const ParticleBatch<float>& batch),
                   (panels, batch))
GP_LOCALIZE_KERNEL(add_log_densities, double,
                   (const HypothesisPanels<double>& panels, const ParticleBatch<double>& batch),
                   (panels, batch))
GP_LOCALIZE_KERNEL(extend_open_slice, float,
                   (HypothesisPanels<float> & panels, const OpenRow<float>& row), (panels, row))
GP_LOCALIZE_KERNEL(extend_open_slice, double,
                   (HypothesisPanels<double> & panels, const OpenRow<double>& row), (panels, row))
GP_LOCALIZE_KERNEL(log_mean_exp, float,
                   (const float* rows, int count, int hypotheses, int stride, double* out),
                   (rows, count, hypotheses, stride, out))
GP_LOCALIZE_KERNEL(log_mean_exp, double,
                   (const double* rows, int count, int hypotheses, int stride, double* out),
                   (rows, count, hypotheses, stride, out))
GP_LOCALIZE_KERNEL(symmetric_multiply, double,
                   (const double* packed, int n, const double* x, double* y), (packed, n, x, y))
GP_LOCALIZE_KERNEL(symmetric_downdate, double,
                   (double* packed, int n, double scale, const double* g), (packed, n, scale, g))

}  // namespace gp_localize
