// Fields that are correlated: the intrinsic coregionalization model (Goovaerts 1997; Bonilla, Chai,
// Williams 2007). In a group of q fields
//   cov(f_a(x), f_b(x')) = B_ab k(x, x'),   B = diag(s) R diag(s)
// with one kernel k of unit variance for all, s the fields' signal standard deviations and R a
// correlation matrix. With B = C C^T, C lower triangular, over the support points of k alone
//   Sigma_SS = B (x) K_SS,   L = C (x) L_k,   phi(x, a) = (row a of C)^T (x) phi_k(x)
// ((x): Kronecker product), so that a group is one sparse Gaussian process of q m support values,
// at places (x, a), whose features cost no more than those of one field. A single field is a group
// of one with B = 1 and the variance in the kernel.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace gp_localize {

/// B and C of a group.
class Coregionalization {
 public:
  /// A single field: B = 1.
  Coregionalization() : Coregionalization(Eigen::MatrixXd::Ones(1, 1)) {}
  /// @param covariance B, q x q
  /// @throws NumericalError if it is not symmetric positive definite
  explicit Coregionalization(const Eigen::MatrixXd& covariance);

  int fields() const { return static_cast<int>(covariance_.rows()); }
  double covariance(int a, int b) const { return covariance_(a, b); }
  /// C_aj.
  double factor(int a, int j) const { return factor_(a, j); }

 private:
  Eigen::MatrixXd covariance_, factor_;
};

/// R from its upper triangle row by row: R_12, R_13 .. R_1q, R_23 .. The size must fit.
Eigen::MatrixXd correlation_matrix(int fields, const std::vector<double>& upper_triangle);
/// The first field (0, 1, ..) whose correlation with those before it is not possible: the
/// correlation matrix of the fields up to it is not positive definite; -1: none. O(q^3).
int impossible_field(const Eigen::MatrixXd& correlation);

}  // namespace gp_localize
