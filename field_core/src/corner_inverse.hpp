// The dense inverse from the last columns of a sparse factor, without work for the factor's zeros.
#pragma once

#include <Eigen/Core>

#include "field_core/panel_product.hpp"
#include "selected_inverse.hpp"

namespace field_core {

/// All rows and columns from `first` on of (L L^T)^-1, in the order of elimination; nothing before
/// `first` is needed for them. Takahashi's recursion (selected_inverse.hpp) for all rows instead of
/// the pattern's, by blocks J of columns, I = the rows below J that are in the pattern of J:
///
///   P = L_IJ L_JJ^-1,  Z_RJ = -Z_RI P,  Z_JJ = L_JJ^-T L_JJ^-1 - P^T Z_IJ,  R = all rows below J.
///
/// O(n^2 |I|), n = columns from `first` on.
Eigen::MatrixXd corner_inverse(const FactorColumns& factor, int first,
                               PanelProduct product = panel_product());

}  // namespace field_core
