#include "field_core/panel_product.hpp"

#include <cstring>

#define FIELD_CORE_INLINE inline __attribute__((always_inline))

namespace field_core {
namespace {

/// In sub-tiles of 3 vectors x kColumns columns.
template <int Bytes>
struct Kernel {
  typedef double Vector __attribute__((vector_size(Bytes)));
  static constexpr int kLanes = Bytes / sizeof(double);
  static constexpr int kVectors = 3;
  static constexpr int kColumns = Bytes == 64 ? 8 : 4;
  static_assert(kPanelHeight % (kVectors * kLanes) == 0 && kTileWidth % kColumns == 0);

  static FIELD_CORE_INLINE void product(int depth, const double* a, const double* b, double* out) {
    for (int r = 0; r < kPanelHeight; r += kVectors * kLanes) {
      for (int c = 0; c < kTileWidth; c += kColumns) {
        Vector sum[kColumns][kVectors] = {};
        const double* x = a + r;
        const double* y = b + c;
        for (int k = 0; k < depth; ++k, x += kPanelHeight, y += kTileWidth) {
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
            std::memcpy(out + (c + j) * kPanelHeight + r + v * kLanes, &sum[j][v], sizeof(Vector));
          }
        }
      }
    }
  }
};

void narrow(int depth, const double* a, const double* b, double* out) {
  Kernel<16>::product(depth, a, b, out);
}
#if defined(__x86_64__)
__attribute__((target("avx2,fma"))) void avx2(int depth, const double* a, const double* b,
                                              double* out) {
  Kernel<32>::product(depth, a, b, out);
}
__attribute__((target("avx512f,avx2,fma"))) void avx512(int depth, const double* a, const double* b,
                                                        double* out) {
  Kernel<64>::product(depth, a, b, out);
}
#endif

}  // namespace

PanelProduct panel_product(VectorWidth most) {
#if defined(__x86_64__)
  if (most == VectorWidth::avx512 && __builtin_cpu_supports("avx512f")) return avx512;
  if (most != VectorWidth::narrow && __builtin_cpu_supports("avx2") &&
      __builtin_cpu_supports("fma")) {
    return avx2;
  }
#else
  (void)most;
#endif
  return narrow;
}

}  // namespace field_core
