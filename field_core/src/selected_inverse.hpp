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
/// Chin 1973; Erisman, Tinney 1975): from the last columns to the first, by nodes J of columns that
/// have their rows I below the node in common,
///   Z_IJ = -Z_II L_IJ L_JJ^-1,  Z_JJ = L_JJ^-T L_JJ^-1 - (L_IJ L_JJ^-1)^T Z_IJ,
/// where Z_II lies within the pattern because of fill. O(sum over nodes of |I|^2 |J|).
/// @param values those of L; on return, of the inverse
void selected_inverse(const FactorColumns& pattern, double* values);

}  // namespace field_core
