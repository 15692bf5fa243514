// Takahashi's recursion: entries of (L L^T)^-1 on the pattern of L, without the rest of the
// inverse.
#pragma once

#include <vector>

namespace field_core {

/// A lower triangular factor in compressed columns, rows ascending, the diagonal first. n columns.
struct FactorColumns {
  int n;
  const int* start;
  const int* row;
  const double* value;
};

/// Entries of (L L^T)^-1 at the positions of L's own entries, in the same order (Takahashi, Fagan,
/// Chin 1973; Erisman, Tinney 1975): from the last column to the first,
///   Z_Ij = -Z_II L_Ij / L_jj,  Z_jj = 1 / L_jj^2 - L_Ij^T Z_Ij / L_jj,  I = rows of L below j,
/// where Z_II lies within the pattern because of fill. O(sum over columns of the lengths of the
/// columns they name).
std::vector<double> selected_inverse(const FactorColumns& factor);

}  // namespace field_core
