#include "vector_field_slam/block_pattern.hpp"

#include <algorithm>

namespace vector_field_slam {

void BlockPattern::build(const std::vector<int>& sizes, std::vector<std::pair<int, int>> pairs) {
  const int blocks = static_cast<int>(sizes.size());
  for (auto& [i, j] : pairs) {
    if (i < j) std::swap(i, j);
    std::swap(i, j);  // (column, row)
  }
  for (int b = 0; b < blocks; ++b) pairs.emplace_back(b, b);
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  order_ = std::move(pairs);

  firsts_.assign(1, 0);
  for (int size : sizes) firsts_.push_back(firsts_.back() + size);
  heights_.assign(blocks, 0);
  starts_.assign(blocks + 1, 0);
  handles_.resize(order_.size());
  for (const auto& [column, row] : order_) {
    heights_[column] += sizes[row];
    ++starts_[column + 1];
  }
  for (int b = 0; b < blocks; ++b) starts_[b + 1] += starts_[b];

  std::vector<int> outer(variables() + 1, 0), inner;
  for (int b = 0; b < blocks; ++b) {
    int place = outer[firsts_[b]];
    for (int k = starts_[b]; k < starts_[b + 1]; ++k) {
      handles_[k] = place;
      place += sizes[order_[k].second];
    }
    for (int j = 0; j < sizes[b]; ++j) {
      outer[firsts_[b] + j + 1] = outer[firsts_[b] + j] + heights_[b] - j;
      for (int k = starts_[b]; k < starts_[b + 1]; ++k) {
        const int row = order_[k].second;
        for (int a = row == b ? j : 0; a < sizes[row]; ++a) inner.push_back(firsts_[row] + a);
      }
    }
  }
  matrix_.resize(variables(), variables());
  matrix_.resizeNonZeros(static_cast<Eigen::Index>(inner.size()));
  std::copy(outer.begin(), outer.end(), matrix_.outerIndexPtr());
  std::copy(inner.begin(), inner.end(), matrix_.innerIndexPtr());
}

int BlockPattern::find(int i, int j) const {
  if (i < j) std::swap(i, j);
  const auto found = std::lower_bound(order_.begin() + starts_[j], order_.begin() + starts_[j + 1],
                                      std::make_pair(j, i));
  return handles_[found - order_.begin()];
}

}  // namespace vector_field_slam
