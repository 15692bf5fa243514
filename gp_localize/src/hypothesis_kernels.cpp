#include "hypothesis_kernels.hpp"

#include <algorithm>
#include <cmath>

#include "vector_math.hpp"

namespace gp_localize {
namespace {

constexpr int kMaxSlice = 600;  // of a group of fields
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
  // Tiles of particles that share a panel while it is in the cache.
  static constexpr int kGroup = kBatch / kRows;
  static_assert(kBatch % kRows == 0);

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

  /// Columns first .. first + kRows - 1 of a matrix, interleaved; the last is repeated past its
  /// end.
  static GP_LOCALIZE_INLINE void gather_rows(const T* matrix, long stride, int rows, int first,
                                             int count, T* out) {
    for (int k = 0; k < rows; ++k) {
      const T* row = matrix + k * stride;
      for (int r = 0; r < kRows; ++r) out[k * kRows + r] = row[std::min(first + r, count - 1)];
    }
  }

  /// A tile's features (interleaved by particle), and their products weighted so that a dot product
  /// with a packed symmetric matrix A is phi^T A phi.
  static GP_LOCALIZE_INLINE void prepare_tile(const PlaceBatch<T>& b, int support, int first,
                                              T* phi, T* products) {
    gather_rows(b.features, b.stride, support, first, b.count, phi);
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
                                                         const PlaceBatch<T>& batch, int panel,
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
        const T* open = b.open_place + (slot + i) * b.dimensions * kWidth + h * kLanes;
        const Vector value = M::load(b.open_value + at);
        for (int r = 0; r < kRows; ++r) {
          const int p = std::min(first + r, batch.count - 1);
          const Vector r2 = squared_distance<M>(b.dimensions, [&](int a) GP_LOCALIZE_INLINE_LAMBDA {
            return M::load(open + a * kWidth) - batch.place[a * batch.count + p];
          });
          Vector rest = b.prior[i] * correlation<M>(b.kernel, r2) - explained[r][h];
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

  static GP_LOCALIZE_INLINE void score_tile(const HypothesisPanels<T>& b, const Scores<T>& scores,
                                            int panel, int first, int count,
                                            const Vector (&mean)[kRows][kParts],
                                            const Vector (&variance)[kRows][kParts]) {
    for (int r = 0; r < kRows && first + r < count; ++r) {
      Vector means{}, squares{};
      for (int h = 0; h < kParts; ++h) {
        const Vector v = variance[r][h], m = mean[r][h];
        const Vector counted = M::load(b.weight + panel * kWidth + h * kLanes);
        means += counted * m;
        squares += counted * (v + m * m);
        if (!scores.log_density) continue;
        T* out = scores.log_density + (static_cast<long>(first + r) * b.panels + panel) * kWidth;
        const Vector error = scores.value - m;
        const Vector term = T(-0.5) * (error * error / v + M::log_of_positive(v));
        M::store(out + h * kLanes, M::load(out + h * kLanes) + term);
      }
      T* moments = scores.moments + 2 * (first + r);
      moments[0] += M::sum(means);
      moments[1] += M::sum(squares);
    }
  }

  /// Calls use(panel, first place, mean, variance) for every tile of places x panel of hypotheses.
  template <class Use>
  static GP_LOCALIZE_INLINE void for_each_prediction(const HypothesisPanels<T>& b,
                                                     const PlaceBatch<T>& places, Use use) {
    const int packed = b.support * (b.support + 1) / 2;
    const long tile_size = static_cast<long>(kRows) * (packed + b.support);
    for (int group = 0; group < places.count; group += kBatch) {
      const int tiles = std::min(kGroup, (places.count - group + kRows - 1) / kRows);
      for (int t = 0; t < tiles; ++t) {
        T* phi = places.scratch + t * tile_size;
        prepare_tile(places, b.support, group + t * kRows, phi, phi + kRows * b.support);
      }
      for (int panel = 0; panel < b.panels; ++panel) {
        const T* means = b.mean + static_cast<long>(panel) * b.support * kWidth;
        const T* covariances = b.covariance + static_cast<long>(panel) * packed * kWidth;
        for (int t = 0; t < tiles; ++t) {
          const int first = group + t * kRows;
          const T* phi = places.scratch + t * tile_size;
          Vector mean[kRows][kParts], variance[kRows][kParts];
          multiply_tile(phi, means, b.support, mean);
          multiply_tile(phi + kRows * b.support, covariances, packed, variance);
          for (int r = 0; r < kRows; ++r) {
            const T rest = places.residual[std::min(first + r, places.count - 1)];
            for (int h = 0; h < kParts; ++h) variance[r][h] += rest;
          }
          condition_on_open_slice(b, places, panel, first, phi, mean, variance);
          use(panel, first, mean, variance);
        }
      }
    }
  }

  static GP_LOCALIZE_INLINE void add_log_densities(const HypothesisPanels<T>& b,
                                                   const PlaceBatch<T>& places,
                                                   const Scores<T>& scores) {
    std::fill(scores.moments, scores.moments + 2 * places.count, T(0));
    for_each_prediction(b, places,
                        [&](int panel, int first, const auto& mean, const auto& variance) {
                          score_tile(b, scores, panel, first, places.count, mean, variance);
                        });
  }

  static GP_LOCALIZE_INLINE void predict_nodes(const HypothesisPanels<T>& b,
                                               const PlaceBatch<T>& places,
                                               const NodePredictions<T>& nodes) {
    for_each_prediction(
        b, places, [&](int panel, int first, const auto& mean, const auto& variance) {
          for (int r = 0; r < kRows && first + r < places.count; ++r) {
            const long at = (static_cast<long>(panel) * nodes.nodes + first + r) * kWidth;
            for (int h = 0; h < kParts; ++h) {
              M::store(nodes.mean + at + h * kLanes, mean[r][h]);
              M::store(nodes.variance + at + h * kLanes, variance[r][h]);
            }
          }
        });
  }

  static GP_LOCALIZE_INLINE void add_interpolated_log_densities(const HypothesisPanels<T>& b,
                                                                const NodePredictions<T>& nodes,
                                                                const Scores<T>& scores) {
    std::fill(scores.moments, scores.moments + 2 * nodes.count, T(0));
    const long tile_size = static_cast<long>(kRows) * nodes.nodes;
    for (int group = 0; group < nodes.count; group += kBatch) {
      const int tiles = std::min(kGroup, (nodes.count - group + kRows - 1) / kRows);
      for (int t = 0; t < tiles; ++t) {
        gather_rows(nodes.coefficients, nodes.count, nodes.nodes, group + t * kRows, nodes.count,
                    nodes.scratch + t * tile_size);
      }
      for (int panel = 0; panel < b.panels; ++panel) {
        const long at = static_cast<long>(panel) * nodes.nodes * kWidth;
        for (int t = 0; t < tiles; ++t) {
          const T* coefficients = nodes.scratch + t * tile_size;
          Vector mean[kRows][kParts], variance[kRows][kParts];
          multiply_tile(coefficients, nodes.mean + at, nodes.nodes, mean);
          multiply_tile(coefficients, nodes.variance + at, nodes.nodes, variance);
          for (int r = 0; r < kRows; ++r) {
            for (int h = 0; h < kParts; ++h) variance[r][h] += nodes.noise_variance;
          }
          score_tile(b, scores, panel, group + t * kRows, nodes.count, mean, variance);
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
        for (int a = 0; a < b.dimensions; ++a) {
          M::store(lane(b.open_place, (slot + last) * b.dimensions + a),
                   M::load(row.place + a * stride + c));
        }
        Vector value = row.value - prediction;
        Vector variance = M::broadcast(row.noise_variance);
        for (int j = 0; j <= last; ++j) {
          const T* open = lane(b.open_place, (slot + j) * b.dimensions);
          const Vector r2 = squared_distance<M>(b.dimensions, [&](int a) GP_LOCALIZE_INLINE_LAMBDA {
            return M::load(open + a * kWidth) - M::load(row.place + a * stride + c);
          });
          Vector rest = b.prior[j] * correlation<M>(b.kernel, r2);
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
};

}  // namespace

#define GP_LOCALIZE_KERNELS(T)                                                                    \
  GP_LOCALIZE_KERNEL(                                                                             \
      add_log_densities, T,                                                                       \
      (const HypothesisPanels<T>& panels, const PlaceBatch<T>& places, const Scores<T>& scores),  \
      (panels, places, scores))                                                                   \
  GP_LOCALIZE_KERNEL(predict_nodes, T,                                                            \
                     (const HypothesisPanels<T>& panels, const PlaceBatch<T>& places,             \
                      const NodePredictions<T>& nodes),                                           \
                     (panels, places, nodes))                                                     \
  GP_LOCALIZE_KERNEL(add_interpolated_log_densities, T,                                           \
                     (const HypothesisPanels<T>& panels, const NodePredictions<T>& nodes,         \
                      const Scores<T>& scores),                                                   \
                     (panels, nodes, scores))                                                     \
  GP_LOCALIZE_KERNEL(extend_open_slice, T, (HypothesisPanels<T> & panels, const OpenRow<T>& row), \
                     (panels, row))
GP_LOCALIZE_KERNELS(float)
GP_LOCALIZE_KERNELS(double)

}  // namespace gp_localize
