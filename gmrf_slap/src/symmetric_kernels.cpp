#include "symmetric_kernels.hpp"

#include <algorithm>
#include <cstring>

#define GMRF_SLAP_INLINE inline __attribute__((always_inline))

namespace gmrf_slap {
namespace {

constexpr int kTileColumns = 8;
// Row panels that are held against all columns at once: about 230 kB for 300 columns, half an L2
// cache.
constexpr int kPanelsPerBlock = 4;

/// A tile of kPanelRows x kTileColumns is computed in sub-tiles that fit the vector registers.
template <int Bytes>
struct Kernel {
  typedef double Vector __attribute__((vector_size(Bytes)));
  static constexpr int kLanes = Bytes / sizeof(double);
  static constexpr int kVectors = 3;
  static constexpr int kRows = kVectors * kLanes;
  static constexpr int kColumns = Bytes == 64 ? 8 : 4;
  static_assert(kPanelRows % kRows == 0 && kTileColumns % kColumns == 0);

  /// out (kPanelRows x kTileColumns, column-major) = rows * columns^T.
  static GMRF_SLAP_INLINE void tile(int columns, const double* a, const double* b, double* out) {
    for (int r = 0; r < kPanelRows; r += kRows) {
      for (int c = 0; c < kTileColumns; c += kColumns) {
        Vector sum[kColumns][kVectors] = {};
        const double* x = a + r;
        const double* y = b + c;
        for (int k = 0; k < columns; ++k, x += kPanelRows, y += kTileColumns) {
          Vector row[kVectors];
#pragma GCC unroll 3
          for (int v = 0; v < kVectors; ++v) std::memcpy(&row[v], x + v * kLanes, sizeof(Vector));
#pragma GCC unroll 8
          for (int j = 0; j < kColumns; ++j) {
#pragma GCC unroll 3
            for (int v = 0; v < kVectors; ++v) sum[j][v] += row[v] * y[j];
          }
        }
#pragma GCC unroll 8
        for (int j = 0; j < kColumns; ++j) {
#pragma GCC unroll 3
          for (int v = 0; v < kVectors; ++v) {
            std::memcpy(out + (c + j) * kPanelRows + r + v * kLanes, &sum[j][v], sizeof(Vector));
          }
        }
      }
    }
  }

  static GMRF_SLAP_INLINE void downdate(int n, double* lower, int columns, const double* panels,
                                        const double* scaled) {
    alignas(64) double out[kPanelRows * kTileColumns];
    const int count = panel_count(n);
    const long panel_size = static_cast<long>(columns) * kPanelRows;
    for (int block = 0; block < count; block += kPanelsPerBlock) {
      const int last = std::min(block + kPanelsPerBlock, count);
      for (int j0 = 0; j0 < std::min(n, last * kPanelRows); j0 += kTileColumns) {
        const double* b = scaled + static_cast<long>(j0) * columns;
        for (int p = std::max(block, j0 / kPanelRows); p < last; ++p) {
          const int i0 = p * kPanelRows;
          tile(columns, panels + p * panel_size, b, out);
          for (int j = j0; j < std::min(j0 + kTileColumns, n); ++j) {
            const int first = std::max(i0, j), end = std::min(i0 + kPanelRows, n);
            double* to = lower + static_cast<long>(j) * n;
            const double* from = out + (j - j0) * kPanelRows - i0;
            for (int i = first; i < end; ++i) to[i] -= from[i];
          }
        }
      }
    }
  }
};

int tile_count(int n) { return (n + kTileColumns - 1) / kTileColumns; }

/// C diag(d) in tiles of kTileColumns rows, the other factor of the product.
void scale_into_tiles(int n, int columns, const double* panels, const double* d, double* scaled) {
  for (int t = 0; t < tile_count(n); ++t) {
    // kPanelRows is a multiple of kTileColumns: a tile lies within one panel.
    const int i0 = t * kTileColumns;
    const double* from =
        panels + static_cast<long>(i0 / kPanelRows) * columns * kPanelRows + i0 % kPanelRows;
    for (int k = 0; k < columns; ++k, from += kPanelRows, scaled += kTileColumns) {
      for (int c = 0; c < kTileColumns; ++c) scaled[c] = from[c] * d[k];
    }
  }
}

using Downdate = void (*)(int, double*, int, const double*, const double*);

void narrow(int n, double* lower, int columns, const double* panels, const double* scaled) {
  Kernel<16>::downdate(n, lower, columns, panels, scaled);
}
#if defined(__x86_64__)
__attribute__((target("avx2,fma"))) void avx2(int n, double* lower, int columns,
                                              const double* panels, const double* scaled) {
  Kernel<32>::downdate(n, lower, columns, panels, scaled);
}
__attribute__((target("avx512f,avx2,fma"))) void avx512(int n, double* lower, int columns,
                                                        const double* panels,
                                                        const double* scaled) {
  Kernel<64>::downdate(n, lower, columns, panels, scaled);
}
#endif

VectorWidth widest(VectorWidth most) {
#if defined(__x86_64__)
  if (most == VectorWidth::avx512 && __builtin_cpu_supports("avx512f")) return most;
  if (most != VectorWidth::narrow && __builtin_cpu_supports("avx2") &&
      __builtin_cpu_supports("fma")) {
    return VectorWidth::avx2;
  }
#else
  (void)most;
#endif
  return VectorWidth::narrow;
}

Downdate version(VectorWidth width) {
#if defined(__x86_64__)
  if (width == VectorWidth::avx512) return avx512;
  if (width == VectorWidth::avx2) return avx2;
#endif
  (void)width;
  return narrow;
}

// Results differ between the versions in the last bits: the same bits need the same kind of
// processor.
Downdate chosen = version(widest(VectorWidth::avx512));

}  // namespace

std::size_t downdate_scratch(int n, int columns) {
  return static_cast<std::size_t>(tile_count(n)) * kTileColumns * static_cast<std::size_t>(columns);
}

void symmetric_downdate(int n, double* lower, int columns, const double* panels, const double* d,
                        double* scratch) {
  scale_into_tiles(n, columns, panels, d, scratch);
  chosen(n, lower, columns, panels, scratch);
}

VectorWidth use_vector_width(VectorWidth most) {
  const VectorWidth width = widest(most);
  chosen = version(width);
  return width;
}

}  // namespace gmrf_slap
