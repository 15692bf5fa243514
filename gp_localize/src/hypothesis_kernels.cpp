#include "hypothesis_kernels.hpp"

#include <algorithm>

#include "vector_math.hpp"

namespace gp_localize {
namespace {

using field_core::KernelType;
constexpr int kRows = 6;    // particles of one register tile: 6 x 2 accumulators fill 16 registers
constexpr int kGroup = 10;  // tiles of particles that share a panel while it is in the cache
constexpr int kMaxSlice = 100;

template <class T>
GP_LOCALIZE_INLINE Vector<T> correlation(KernelType type, Vector<T> r2) {
  if (type == KernelType::squared_exponential) return exp_of_negative<T>(r2 * T(-0.5));
  const bool smooth = type == KernelType::matern52;
  const Vector<T> r = square_root<T>(r2 * (smooth ? T(5) : T(3)));
  const Vector<T> decay = exp_of_negative<T>(-r);
  return smooth ? (T(1) + r + r * r * T(1.0 / 3.0)) * decay : (T(1) + r) * decay;
}

template <class T>
GP_LOCALIZE_INLINE void features_impl(const WhitenedSupport& b, int n, const double* points,
                                      int stride, double* features) {
  constexpr int kLanes = 2 * VectorTraits<T>::kLanes;
  constexpr int kMaxSupport = 400;
  alignas(64) T column[kMaxSupport][kLanes];
  for (int begin = 0; begin < n; begin += kLanes) {
    const int count = std::min(kLanes, n - begin);
    alignas(64) T px[kLanes], py[kLanes];
    for (int l = 0; l < kLanes; ++l) {
      const double* p = points + static_cast<long>(begin + std::min(l, count - 1)) * stride;
      px[l] = p[0];
      py[l] = p[1];
    }
    for (int i = 0; i < b.size; ++i) {
      for (int h = 0; h < kLanes; h += kLanes / 2) {
        const Vector<T> dx = (load(px + h) - b.support[2 * i]) / b.length_x;
        const Vector<T> dy = (load(py + h) - b.support[2 * i + 1]) / b.length_y;
        store(&column[i][h], b.signal_variance * correlation<T>(b.kernel, dx * dx + dy * dy));
      }
    }
    for (int i = b.size - 1; i >= 0; --i) {
      const T* w = b.whitening + static_cast<long>(i) * b.size;
      Vector<T> low{}, high{};
      for (int k = 0; k <= i; ++k) {
        low += w[k] * load(&column[k][0]);
        high += w[k] * load(&column[k][kLanes / 2]);
      }
      alignas(64) T row[kLanes];
      store(row, low);
      store(row + kLanes / 2, high);
      std::copy(row, row + count, features + static_cast<long>(i) * n + begin);
    }
  }
}

/// sums[r] += sum_k rows[k][r] * panel[k]: a tile of particles against one panel of hypotheses.
template <class T>
GP_LOCALIZE_INLINE void multiply_tile(const T* rows, const T* panel, int k_end,
                                      Vector<T> (&sums)[kRows][2]) {
  constexpr int kHalf = VectorTraits<T>::kLanes;
  Vector<T> acc[kRows][2];
  for (int r = 0; r < kRows; ++r) acc[r][0] = acc[r][1] = Vector<T>{};
  for (int k = 0; k < k_end; ++k) {
    const Vector<T> low = load(panel), high = load(panel + kHalf);
#pragma GCC unroll 6
    for (int r = 0; r < kRows; ++r) {
      acc[r][0] += rows[r] * low;
      acc[r][1] += rows[r] * high;
    }
    rows += kRows;
    panel += 2 * kHalf;
  }
  for (int r = 0; r < kRows; ++r) {
    sums[r][0] = acc[r][0];
    sums[r][1] = acc[r][1];
  }
}

/// A tile's features (interleaved by particle), and their products weighted so that a dot product
/// with a packed symmetric matrix A is phi^T A phi.
template <class T>
GP_LOCALIZE_INLINE void prepare_tile(const ParticleBatch<T>& b, int support, int first, T* phi,
                                     T* products) {
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
template <class T>
GP_LOCALIZE_INLINE void condition_on_open_slice(const HypothesisPanels<T>& b,
                                                const ParticleBatch<T>& batch, int panel, int first,
                                                const T* phi, Vector<T> (&mean)[kRows][2],
                                                Vector<T> (&variance)[kRows][2]) {
  constexpr int kHalf = VectorTraits<T>::kLanes;
  constexpr int kWidth = 2 * kHalf;
  const long slot = static_cast<long>(panel) * b.slice_size;
  Vector<T> q[kMaxSlice][kRows][2];
  for (int i = 0; i < b.open; ++i) {
    Vector<T> explained[kRows][2];
    multiply_tile(phi, b.open_gain + (slot + i) * b.support * kWidth, b.support, explained);
    const T* factor = b.open_factor + (slot + i) * b.slice_size * kWidth;
    for (int h = 0; h < 2; ++h) {
      const long at = (slot + i) * kWidth + h * kHalf;
      const Vector<T> ox = load(b.open_x + at), oy = load(b.open_y + at);
      const Vector<T> value = load(b.open_value + at);
      for (int r = 0; r < kRows; ++r) {
        const int p = std::min(first + r, batch.count - 1);
        const Vector<T> dx = ox - batch.x[p], dy = oy - batch.y[p];
        Vector<T> rest =
            b.signal_variance * correlation<T>(b.kernel, dx * dx + dy * dy) - explained[r][h];
        for (int j = 0; j < i; ++j) rest -= load(factor + j * kWidth + h * kHalf) * q[j][r][h];
        rest *= load(factor + i * kWidth + h * kHalf);
        q[i][r][h] = rest;
        mean[r][h] += rest * value;
        variance[r][h] -= rest * rest;
      }
    }
  }
}

template <class T>
GP_LOCALIZE_INLINE void write_tile(const HypothesisPanels<T>& b, const ParticleBatch<T>& batch,
                                   int panel, int first, const Vector<T> (&mean)[kRows][2],
                                   const Vector<T> (&variance)[kRows][2]) {
  constexpr int kHalf = VectorTraits<T>::kLanes;
  constexpr int kWidth = 2 * kHalf;
  alignas(64) T mask[kWidth];
  for (int l = 0; l < kWidth; ++l) mask[l] = panel * kWidth + l < b.hypotheses ? T(1) : T(0);
  for (int r = 0; r < kRows && first + r < batch.count; ++r) {
    Vector<T> means{}, squares{};
    for (int h = 0; h < 2; ++h) {
      const Vector<T> v = variance[r][h], m = mean[r][h];
      const Vector<T> counted = load(mask + h * kHalf);
      means += counted * m;
      squares += counted * (v + m * m);
      if (!batch.log_density) continue;
      T* out = batch.log_density + (static_cast<long>(first + r) * b.panels + panel) * kWidth;
      const Vector<T> error = batch.value - m;
      const Vector<T> term = T(-0.5) * (error * error / v + log_of_positive<T>(v));
      store(out + h * kHalf, load(out + h * kHalf) + term);
    }
    T* moments = batch.moments + 2 * (first + r);
    moments[0] += sum<T>(means);
    moments[1] += sum<T>(squares);
  }
}

template <class T>
GP_LOCALIZE_INLINE void log_densities_impl(const HypothesisPanels<T>& b,
                                           const ParticleBatch<T>& batch) {
  constexpr int kWidth = 2 * VectorTraits<T>::kLanes;
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
        Vector<T> mean[kRows][2], variance[kRows][2];
        multiply_tile(phi, means, b.support, mean);
        multiply_tile(phi + kRows * b.support, covariances, packed, variance);
        for (int r = 0; r < kRows; ++r) {
          const T rest = batch.residual[std::min(first + r, batch.count - 1)];
          variance[r][0] += rest;
          variance[r][1] += rest;
        }
        condition_on_open_slice(b, batch, panel, first, phi, mean, variance);
        write_tile(b, batch, panel, first, mean, variance);
      }
    }
  }
}

/// phi - A phi and m^T phi for half a panel of hypotheses.
template <class T>
GP_LOCALIZE_INLINE void open_gain(const HypothesisPanels<T>& b, int panel, int half,
                                  const Vector<T>* phi, T* gain, Vector<T>& mean) {
  constexpr int kHalf = VectorTraits<T>::kLanes;
  constexpr int kWidth = 2 * kHalf;
  const int m = b.support;
  const T* a = b.covariance + static_cast<long>(panel) * (m * (m + 1) / 2) * kWidth + half * kHalf;
  const T* weights = b.mean + static_cast<long>(panel) * m * kWidth + half * kHalf;
  mean = Vector<T>{};
  for (int k = 0; k < m; ++k) {
    store(gain + k * kWidth, phi[k]);
    mean += phi[k] * load(weights + k * kWidth);
  }
  for (int j = 0; j < m; ++j) {
    Vector<T> column = load(a) * phi[j];
    a += kWidth;
    for (int i = j + 1; i < m; ++i, a += kWidth) {
      const Vector<T> aij = load(a);
      store(gain + i * kWidth, load(gain + i * kWidth) - aij * phi[j]);
      column += aij * phi[i];
    }
    store(gain + j * kWidth, load(gain + j * kWidth) - column);
  }
}

template <class T>
GP_LOCALIZE_INLINE void extend_impl(HypothesisPanels<T>& b, const OpenRow<T>& row) {
  constexpr int kHalf = VectorTraits<T>::kLanes;
  constexpr int kWidth = 2 * kHalf;
  constexpr int kMaxSupport = 400;
  const int last = b.open;
  const long stride = static_cast<long>(b.panels) * kWidth;
  Vector<T> phi[kMaxSupport], covariance[kMaxSlice];
  for (int panel = 0; panel < b.panels; ++panel) {
    const long slot = static_cast<long>(panel) * b.slice_size;
    for (int half = 0; half < 2; ++half) {
      const long c = panel * kWidth + half * kHalf;
      const auto lane = [&](T* array, long index) { return array + index * kWidth + half * kHalf; };
      for (int k = 0; k < b.support; ++k) phi[k] = load(row.features + k * stride + c);
      Vector<T> prediction;
      T* gain = lane(b.open_gain, (slot + last) * b.support);
      open_gain(b, panel, half, phi, gain, prediction);
      const Vector<T> x = load(row.x + c), y = load(row.y + c);
      store(lane(b.open_x, slot + last), x);
      store(lane(b.open_y, slot + last), y);
      Vector<T> value = row.value - prediction;
      Vector<T> variance = broadcast<T>(row.noise_variance);
      for (int j = 0; j <= last; ++j) {
        const Vector<T> dx = load(lane(b.open_x, slot + j)) - x;
        const Vector<T> dy = load(lane(b.open_y, slot + j)) - y;
        Vector<T> rest = b.signal_variance * correlation<T>(b.kernel, dx * dx + dy * dy);
        const T* known = lane(b.open_gain, (slot + j) * b.support);
        for (int k = 0; k < b.support; ++k) rest -= phi[k] * load(known + k * kWidth);
        if (j == last) {
          variance += rest;
          break;
        }
        const long factor = (slot + j) * b.slice_size;
        for (int i = 0; i < j; ++i) rest -= load(lane(b.open_factor, factor + i)) * covariance[i];
        rest *= load(lane(b.open_factor, factor + j));
        covariance[j] = rest;
        store(lane(b.open_factor, (slot + last) * b.slice_size + j), rest);
        value -= rest * load(lane(b.open_value, slot + j));
        variance -= rest * rest;
      }
      const Vector<T> inverse = T(1) / square_root<T>(variance);
      store(lane(b.open_factor, (slot + last) * b.slice_size + last), inverse);
      store(lane(b.open_value, slot + last), value * inverse);
    }
  }
  ++b.open;
}

template <class T>
GP_LOCALIZE_INLINE void log_mean_exp_impl(const T* rows, int count, int hypotheses, int stride,
                                          double* out) {
  constexpr int kHalf = VectorTraits<T>::kLanes;
  for (int p = 0; p < count; ++p, rows += stride) {
    const T largest = *std::max_element(rows, rows + hypotheses);
    Vector<T> sums{};
    int c = 0;
    for (; c + kHalf <= hypotheses; c += kHalf) {
      sums += exp_of_negative<T>(load(rows + c) - largest);
    }
    double total = sum<T>(sums);
    for (; c < hypotheses; ++c) total += std::exp(static_cast<double>(rows[c] - largest));
    out[p] = static_cast<double>(largest) + std::log(total / hypotheses);
  }
}

}  // namespace

int scratch_size(int support) {
  return kGroup * kRows * (support * (support + 1) / 2 + support);
}

GP_LOCALIZE_CLONES void whitened_features(const WhitenedSupport& basis, int n, const double* points,
                                          int stride, double* features) {
  features_impl<double>(basis, n, points, stride, features);
}
GP_LOCALIZE_CLONES void add_log_densities(const HypothesisPanels<float>& panels,
                                          const ParticleBatch<float>& batch) {
  log_densities_impl(panels, batch);
}
GP_LOCALIZE_CLONES void add_log_densities(const HypothesisPanels<double>& panels,
                                          const ParticleBatch<double>& batch) {
  log_densities_impl(panels, batch);
}
GP_LOCALIZE_CLONES void extend_open_slice(HypothesisPanels<float>& panels,
                                          const OpenRow<float>& row) {
  extend_impl(panels, row);
}
GP_LOCALIZE_CLONES void extend_open_slice(HypothesisPanels<double>& panels,
                                          const OpenRow<double>& row) {
  extend_impl(panels, row);
}
GP_LOCALIZE_CLONES void log_mean_exp(const float* rows, int count, int hypotheses, int stride,
                                     double* out) {
  log_mean_exp_impl(rows, count, hypotheses, stride, out);
}
GP_LOCALIZE_CLONES void log_mean_exp(const double* rows, int count, int hypotheses, int stride,
                                     double* out) {
  log_mean_exp_impl(rows, count, hypotheses, stride, out);
}

GP_LOCALIZE_CLONES void symmetric_multiply(const double* packed, int n, const double* x, double* y) {
  constexpr int kLanes = VectorTraits<double>::kLanes;
  std::fill(y, y + n, 0.0);
  for (int j = 0; j < n; ++j) {
    const int below = n - j - 1;
    const double* a = packed + 1;
    const double* xs = x + j + 1;
    double* ys = y + j + 1;
    Vector<double> dots{};
    int i = 0;
    for (; i + kLanes <= below; i += kLanes) {
      const Vector<double> column = load(a + i);
      store(ys + i, load(ys + i) + column * x[j]);
      dots += column * load(xs + i);
    }
    double dot = sum<double>(dots);
    for (; i < below; ++i) {
      ys[i] += a[i] * x[j];
      dot += a[i] * xs[i];
    }
    y[j] += packed[0] * x[j] + dot;
    packed += n - j;
  }
}

GP_LOCALIZE_CLONES void symmetric_downdate(double* packed, int n, double scale, const double* g) {
  constexpr int kLanes = VectorTraits<double>::kLanes;
  for (int j = 0; j < n; ++j) {
    const double s = scale * g[j];
    int i = 0;
    for (; i + kLanes <= n - j; i += kLanes) {
      store(packed + i, load(packed + i) - s * load(g + j + i));
    }
    for (; i < n - j; ++i) packed[i] -= s * g[j + i];
    packed += n - j;
  }
}

}  // namespace gp_localize
