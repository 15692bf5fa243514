// Numeric Cholesky factorization by supernodes, in dense blocks with vector instructions but
// without BLAS, whose threads could change the last bits. One thread.
#pragma once

#include "field_core/panel_product.hpp"
#include "selected_inverse.hpp"

namespace field_core {

/// Supernodes as CHOLMOD analyses them: columns super[k] ... super[k + 1] - 1 share the rows
/// s[pi[k]] ... s[pi[k + 1] - 1], the first of which are those columns themselves; their values are
/// a dense column-major block at x + px[k].
struct Supernodes {
  int n, count;
  const int *super, *pi, *px, *s;
};

/// Writes L L^T = A into x, left-looking (Ng, Peyton 1993). `a`: the lower triangle of A in the
/// order of elimination, compressed columns, rows in any order. The strict upper triangles of
/// diagonal blocks in x are undefined.
/// @return the first column whose pivot is not positive, or n
int factorize_supernodes(const Supernodes& nodes, const FactorColumns& a, double* x,
                         PanelProduct product = panel_product());

}  // namespace field_core
