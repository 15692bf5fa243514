// Where the blocks of a symmetric block matrix lie in compressed columns.
#pragma once

#include <Eigen/SparseCore>
#include <utility>
#include <vector>

namespace vector_field_slam {

/// Lower triangle of a symmetric matrix of dense blocks. Built once per pattern; blocks are then
/// added without searching.
class BlockPattern {
 public:
  /// @param sizes rows of each block row
  /// @param pairs blocks (i, j) that are not zero, in any order, repeated or not; the diagonal is
  ///        always there. O(n log n)
  void build(const std::vector<int>& sizes, std::vector<std::pair<int, int>> pairs);

  int first(int block) const { return firsts_[block]; }  ///< its first variable
  int variables() const { return firsts_.back(); }
  Eigen::SparseMatrix<double>& matrix() { return matrix_; }
  const Eigen::SparseMatrix<double>& matrix() const { return matrix_; }

  /// Handle of block (i, j) or (j, i), which must be in the pattern. O(log of the column's blocks)
  int find(int i, int j) const;

  /// Adds `values(row0 + a, column0 + b)` for the block of rows i and columns j; `values` is
  /// symmetric and of the diagonal block only the lower triangle counts.
  /// @param handle find(i, j)
  template <class Matrix>
  void add(int handle, int i, int j, const Matrix& values, int row0, int column0) {
    if (i < j) {
      std::swap(i, j);
      std::swap(row0, column0);
    }
    const int columns = size(j), rows = size(i);
    double* x = matrix_.valuePtr() + handle;
    for (int b = 0; b < columns; ++b) {
      const int from = i == j ? b : 0;
      for (int a = from; a < rows; ++a) x[a] += values(row0 + a, column0 + b);
      x += heights_[j] - b - 1;  // to the same rows of the next column
    }
  }

 private:
  int size(int block) const { return firsts_[block + 1] - firsts_[block]; }

  std::vector<int> firsts_;
  std::vector<int> heights_;                // entries in the first column of each block column
  std::vector<std::pair<int, int>> order_;  // (column, row) of the blocks, sorted
  std::vector<int> handles_;                // of each: place of its first entry in the values
  std::vector<int> starts_;                 // of each block column in order_
  Eigen::SparseMatrix<double> matrix_;
};

}  // namespace vector_field_slam
