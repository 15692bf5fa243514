// A symmetric sparse matrix that grows in small blocks: both triangles, row by row.
#pragma once

#include <Eigen/SparseCore>
#include <algorithm>
#include <memory>
#include <vector>

namespace gmrf_slap {

/// Copies share the rows that have not changed since compact().
class SparseRows {
 public:
  struct Entry {
    int column;
    double value;
  };
  /// Entries of one row, by column; valid until the row changes.
  class Row {
   public:
    Row(const Entry* begin, const Entry* end) : begin_(begin), end_(end) {}
    const Entry* begin() const { return begin_; }
    const Entry* end() const { return end_; }
    std::size_t size() const { return static_cast<std::size_t>(end_ - begin_); }

   private:
    const Entry *begin_, *end_;
  };

  explicit SparseRows(const Eigen::SparseMatrix<double>& symmetric)
      : changed_(static_cast<std::size_t>(symmetric.cols()), kShared) {
    Base base;
    base.start.push_back(0);
    for (int j = 0; j < symmetric.outerSize(); ++j) {
      for (Eigen::SparseMatrix<double>::InnerIterator it(symmetric, j); it; ++it) {
        base.entries.push_back({static_cast<int>(it.row()), it.value()});
      }
      base.start.push_back(base.entries.size());
    }
    base_ = std::make_shared<const Base>(std::move(base));
  }
  int size() const { return static_cast<int>(changed_.size()); }
  Row row(int i) const {
    const int own = changed_[static_cast<std::size_t>(i)];
    if (own != kShared) {
      const std::vector<Entry>& entries = own_[static_cast<std::size_t>(own)];
      return {entries.data(), entries.data() + entries.size()};
    }
    const Entry* entries = base_->entries.data();
    return {entries + base_->start[static_cast<std::size_t>(i)],
            entries + base_->start[static_cast<std::size_t>(i) + 1]};
  }
  /// Adds values[k] at columns[k], ascending; the caller adds to the mirror image too. O(row +
  /// count).
  void add(int i, const std::vector<int>& columns, const double* values) {
    std::vector<Entry>& to = own(i);
    merged_.clear();
    auto at = to.cbegin();
    for (std::size_t k = 0; k < columns.size(); ++k) {
      while (at != to.cend() && at->column < columns[k]) merged_.push_back(*at++);
      const bool there = at != to.cend() && at->column == columns[k];
      merged_.push_back({columns[k], there ? at++->value + values[k] : values[k]});
    }
    merged_.insert(merged_.end(), at, to.cend());
    to.assign(merged_.begin(), merged_.end());
  }
  void add(int i, int j, double value) { add(i, std::vector<int>{j}, &value); }
  /// All rows are shared by the copies made from now on. O(entries).
  void compact() {
    Base base;
    base.entries.reserve(entries());
    base.start.push_back(0);
    for (int i = 0; i < size(); ++i) {
      base.entries.insert(base.entries.end(), row(i).begin(), row(i).end());
      base.start.push_back(base.entries.size());
    }
    base_ = std::make_shared<const Base>(std::move(base));
    std::fill(changed_.begin(), changed_.end(), kShared);
    own_ = {};
  }
  std::size_t entries() const {
    std::size_t count = 0;
    for (int i = 0; i < size(); ++i) count += row(i).size();
    return count;
  }
  /// The shared rows count in full.
  std::size_t memory_bytes() const {
    std::size_t bytes = base_->entries.capacity() * sizeof(Entry) +
                        changed_.size() * (sizeof(int) + sizeof(std::size_t));
    for (const auto& row : own_) bytes += sizeof(row) + row.capacity() * sizeof(Entry);
    return bytes;
  }

 private:
  static constexpr int kShared = -1;
  struct Base {
    std::vector<std::size_t> start;
    std::vector<Entry> entries;
  };

  std::vector<Entry>& own(int i) {
    int& place = changed_[static_cast<std::size_t>(i)];
    if (place == kShared) {
      const Row shared = row(i);
      own_.emplace_back(shared.begin(), shared.end());
      place = static_cast<int>(own_.size()) - 1;
    }
    return own_[static_cast<std::size_t>(place)];
  }

  std::shared_ptr<const Base> base_;
  std::vector<int> changed_;  // per row: kShared, or its place in own_
  std::vector<std::vector<Entry>> own_;
  std::vector<Entry> merged_;  // kept between calls
};

}  // namespace gmrf_slap
