// A symmetric sparse matrix that grows in small blocks: both triangles, row by row.
#pragma once

#include <Eigen/SparseCore>
#include <algorithm>
#include <vector>

namespace gmrf_slap {

class SparseRows {
 public:
  struct Entry {
    int column;
    double value;
  };
  explicit SparseRows(const Eigen::SparseMatrix<double>& symmetric) {
    rows_.resize(static_cast<std::size_t>(symmetric.cols()));
    for (int j = 0; j < symmetric.outerSize(); ++j) {
      for (Eigen::SparseMatrix<double>::InnerIterator it(symmetric, j); it; ++it) {
        rows_[static_cast<std::size_t>(j)].push_back({static_cast<int>(it.row()), it.value()});
      }
    }
  }
  int size() const { return static_cast<int>(rows_.size()); }
  const std::vector<Entry>& row(int i) const { return rows_[static_cast<std::size_t>(i)]; }
  /// Adds to one entry; the caller adds to its mirror image too. O(log row + new entries).
  void add(int i, int j, double value) {
    std::vector<Entry>& row = rows_[static_cast<std::size_t>(i)];
    const auto at = std::lower_bound(row.begin(), row.end(), j,
                                     [](const Entry& e, int c) { return e.column < c; });
    if (at != row.end() && at->column == j) {
      at->value += value;
    } else {
      row.insert(at, {j, value});
    }
  }
  std::size_t entries() const {
    std::size_t count = 0;
    for (const auto& row : rows_) count += row.size();
    return count;
  }
  std::size_t memory_bytes() const {
    std::size_t bytes = rows_.size() * sizeof(rows_[0]);
    for (const auto& row : rows_) bytes += row.capacity() * sizeof(Entry);
    return bytes;
  }

 private:
  std::vector<std::vector<Entry>> rows_;
};

}  // namespace gmrf_slap
