#include "symmetric_kernels.hpp"

#include <algorithm>

namespace gmrf_slap {
namespace {

constexpr int kTileColumns = field_core::kTileWidth;
// Row panels that are held against all columns at once: about 230 kB for 300 columns, half an L2
// cache.
constexpr int kPanelsPerBlock = 4;

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

#if defined(__x86_64__)
#define GMRF_SLAP_ANY_WIDTH __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define GMRF_SLAP_ANY_WIDTH
#endif

/// The part of a tile (kPanelRows x kTileColumns, column-major) at (i0, j0) that is in the lower
/// triangle. The same bits at any width.
GMRF_SLAP_ANY_WIDTH void subtract_tile(int n, int i0, int j0, const double* tile, double* lower) {
  for (int j = j0; j < std::min(j0 + kTileColumns, n); ++j) {
    const int first = std::max(i0, j), end = std::min(i0 + kPanelRows, n);
    double* to = lower + static_cast<long>(j) * n;
    const double* from = tile + (j - j0) * kPanelRows - i0;
    for (int i = first; i < end; ++i) to[i] -= from[i];
  }
}

field_core::PanelProduct product = field_core::panel_product();

}  // namespace

std::size_t downdate_scratch(int n, int columns) {
  return static_cast<std::size_t>(tile_count(n)) * kTileColumns * static_cast<std::size_t>(columns);
}

void symmetric_downdate(int n, double* lower, int columns, const double* panels, const double* d,
                        double* scratch) {
  scale_into_tiles(n, columns, panels, d, scratch);
  alignas(64) double tile[kPanelRows * kTileColumns];
  const int count = panel_count(n);
  const long panel_size = static_cast<long>(columns) * kPanelRows;
  for (int block = 0; block < count; block += kPanelsPerBlock) {
    const int last = std::min(block + kPanelsPerBlock, count);
    for (int j0 = 0; j0 < std::min(n, last * kPanelRows); j0 += kTileColumns) {
      const double* scaled = scratch + static_cast<long>(j0) * columns;
      for (int p = std::max(block, j0 / kPanelRows); p < last; ++p) {
        product(columns, panels + p * panel_size, scaled, tile);
        subtract_tile(n, p * kPanelRows, j0, tile, lower);
      }
    }
  }
}

void use_vector_width(VectorWidth most) { product = field_core::panel_product(most); }

}  // namespace gmrf_slap
