// A small dense product that fits the vector registers, compiled for several instruction sets and
// chosen at run time.
#pragma once

namespace field_core {

constexpr int kPanelHeight = 24, kTileWidth = 8;

enum class VectorWidth { narrow, avx2, avx512 };

/// out (kPanelHeight x kTileWidth, column-major) = A B^T, A: kPanelHeight x depth, column-major,
/// B: kTileWidth x depth, column-major.
using PanelProduct = void (*)(int depth, const double* a, const double* b, double* out);

/// The widest version that the processor has and `most` allows. Versions differ in the last bits:
/// the same bits need the same kind of processor.
PanelProduct panel_product(VectorWidth most = VectorWidth::avx512);

}  // namespace field_core
