// Sigma -= C diag(d) C^T for a symmetric matrix, the hot loop of the dense engine, by
// field_core::panel_product. Callers own all memory.
#pragma once

#include <cstddef>

#include "field_core/panel_product.hpp"

namespace gmrf_slap {

/// C is laid in panels of kPanelRows rows: row i, column k at
/// panels[(i / kPanelRows) columns kPanelRows + k kPanelRows + i % kPanelRows]; rows beyond n are
/// 0.
constexpr int kPanelRows = field_core::kPanelHeight;

inline int panel_count(int n) { return (n + kPanelRows - 1) / kPanelRows; }
/// Numbers of scratch that symmetric_downdate needs.
std::size_t downdate_scratch(int n, int columns);

/// The lower triangle (column-major, n x n) of Sigma -= C diag(d) C^T. The strict upper triangle is
/// neither read nor written. O(n^2 columns / 2).
void symmetric_downdate(int n, double* lower, int columns, const double* panels, const double* d,
                        double* scratch);

using field_core::VectorWidth;
/// The widest version that the processor has and `most` allows is used from now on. For tests and
/// benchmarks.
void use_vector_width(VectorWidth most);

}  // namespace gmrf_slap
