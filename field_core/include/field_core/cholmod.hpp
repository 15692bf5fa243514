// Sparse Cholesky factorization by CHOLMOD (SuiteSparse), with typed failure.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <memory>
#include <vector>

namespace field_core {

/// How columns are eliminated. simplicial: one by one, by CHOLMOD. supernodal: in dense blocks with
/// vector instructions, several times as fast for large or well-filled factors. They differ in
/// rounding only; `supernodal` depends in its last bits on the processor's vector width.
enum class Elimination { simplicial, supernodal };

/// LL^T of a symmetric positive definite sparse matrix, with fill-reducing ordering (AMD).
/// The analysis is reused while the pattern stays the same.
class SparseCholesky {
 public:
  explicit SparseCholesky(Elimination elimination = Elimination::simplicial);
  ~SparseCholesky();
  SparseCholesky(SparseCholesky&&) noexcept;
  SparseCholesky& operator=(SparseCholesky&&) noexcept;

  /// Factorizes; only the lower triangle is read. Compressed storage.
  /// @throws NumericalError with the column of the original matrix where a pivot was not positive,
  /// and
  ///         what usually causes it; the object then holds no factor
  void factorize(const Eigen::SparseMatrix<double>& lower);
  /// The same with the variables of `block` eliminated last, for block_covariance().
  void factorize(const Eigen::SparseMatrix<double>& lower, const std::vector<int>& block);

  /// @throws NumericalError if nothing is factorized or the sizes differ
  Eigen::MatrixXd solve(const Eigen::Ref<const Eigen::MatrixXd>& rhs) const;
  double log_determinant() const;
  /// Diagonal of the inverse by selected inversion; the inverse itself is never formed. Time and
  /// memory of a few factorizations. @throws NumericalError if nothing is factorized
  Eigen::VectorXd inverse_diagonal() const;
  /// The inverse at the positions of `pattern`, a lower triangle in compressed storage, instead of
  /// its values; as inverse_diagonal(). Those of the matrix' own pattern are always there. The
  /// inverse takes the place of the factor, which may be large: factorize() before anything else.
  /// @throws NumericalError if the factor has no entry at one of the positions
  Eigen::SparseMatrix<double> selected_inverse(Eigen::SparseMatrix<double> pattern);
  /// Covariance of the variables that factorize() was asked to keep for last, in the order of
  /// `block`: their rows and columns of the whole inverse, from the last columns of the factor
  /// alone. O(block^2 x entries of such a column). @throws NumericalError if there is no such block
  Eigen::MatrixXd block_covariance() const;
  Eigen::Index size() const;
  std::size_t analyses() const;  ///< how often the pattern was analysed

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace field_core
