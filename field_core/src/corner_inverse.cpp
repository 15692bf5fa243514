#include "corner_inverse.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <vector>

namespace field_core {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr int kBlock = 4 * kTileWidth;

class CornerInverse {
 public:
  CornerInverse(const FactorColumns& factor, int first, PanelProduct product)
      : factor_(factor),
        first_(first),
        n_(factor.n - first),
        multiply_(product),
        place_(static_cast<std::size_t>(n_), -1),
        z_(n_, n_) {}

  MatrixXd run() {
    for (int j = (n_ - 1) / kBlock * kBlock; j >= 0; j -= kBlock) {
      gather(j, std::min(j + kBlock, n_));
      below(j, std::min(j + kBlock, n_));
      diagonal(j, std::min(j + kBlock, n_));
    }
    return std::move(z_);
  }

 private:
  /// L_JJ, I and P of the columns begin ... end - 1.
  void gather(int begin, int end) {
    rows_.clear();
    for (int j = begin; j < end; ++j) {
      for (int p = factor_.start[first_ + j]; p < factor_.start[first_ + j + 1]; ++p) {
        const int row = factor_.row[p] - first_;
        int& place = place_[static_cast<std::size_t>(row)];
        if (row < end || place >= 0) continue;
        place = 0;
        rows_.push_back(row);
      }
    }
    std::sort(rows_.begin(), rows_.end());
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      place_[static_cast<std::size_t>(rows_[k])] = static_cast<int>(k);
    }
    const int width = end - begin;
    top_.setZero(width, width);
    p_.setZero(static_cast<Index>(rows_.size()), width);
    for (int j = begin; j < end; ++j) {
      for (int p = factor_.start[first_ + j]; p < factor_.start[first_ + j + 1]; ++p) {
        const int row = factor_.row[p] - first_;
        if (row < end) {
          top_(row - begin, j - begin) = factor_.value[p];
        } else {
          p_(place_[static_cast<std::size_t>(row)], j - begin) = factor_.value[p];
        }
      }
    }
    for (const int row : rows_) place_[static_cast<std::size_t>(row)] = -1;
    top_.triangularView<Eigen::Lower>().solveInPlace<Eigen::OnTheRight>(p_);
  }

  /// Z_RJ = -Z_RI P and its mirror image.
  void below(int begin, int end) {
    const int depth = static_cast<int>(rows_.size()), width = end - begin;
    const int tiles = (width + kTileWidth - 1) / kTileWidth;
    const auto tile_size = static_cast<std::size_t>(depth) * kTileWidth;
    tiles_.assign(static_cast<std::size_t>(tiles) * tile_size, 0.0);
    for (int c = 0; c < width; ++c) {
      double* to = tiles_.data() + static_cast<std::size_t>(c / kTileWidth) * tile_size;
      for (int k = 0; k < depth; ++k) to[k * kTileWidth + c % kTileWidth] = -p_(k, c);
    }
    panel_.resize(static_cast<std::size_t>(depth) * kPanelHeight);
    for (int r = end; r < n_; r += kPanelHeight) {
      const int height = std::min(kPanelHeight, n_ - r);
      for (int k = 0; k < depth; ++k) {
        double* to = panel_.data() + static_cast<std::size_t>(k) * kPanelHeight;
        const double* from = z_.col(rows_[static_cast<std::size_t>(k)]).data() + r;
        std::copy(from, from + height, to);
        std::fill(to + height, to + kPanelHeight, 0.0);
      }
      for (int t = 0; t < tiles; ++t) {
        alignas(64) double out[kPanelHeight * kTileWidth];
        multiply_(depth, panel_.data(), tiles_.data() + static_cast<std::size_t>(t) * tile_size,
                  out);
        const int j = begin + t * kTileWidth, columns = std::min(kTileWidth, end - j);
        for (int c = 0; c < columns; ++c) {
          std::copy(out + c * kPanelHeight, out + c * kPanelHeight + height,
                    z_.col(j + c).data() + r);
        }
        for (int i = 0; i < height; ++i) {
          double* to = z_.col(r + i).data() + j;
          for (int c = 0; c < columns; ++c) to[c] = out[c * kPanelHeight + i];
        }
      }
    }
  }

  void diagonal(int begin, int end) {
    const int width = end - begin;
    below_.resize(static_cast<Index>(rows_.size()), width);
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      for (int c = 0; c < width; ++c) below_(static_cast<Index>(k), c) = z_(rows_[k], begin + c);
    }
    root_.setIdentity(width, width);
    top_.triangularView<Eigen::Lower>().solveInPlace(root_);
    corner_.noalias() = root_.transpose() * root_;
    if (!rows_.empty()) corner_.noalias() -= p_.transpose() * below_;
    for (int a = 0; a < width; ++a) {
      for (int b = 0; b <= a; ++b) {
        z_(begin + a, begin + b) = z_(begin + b, begin + a) = corner_(a, b);
      }
    }
  }

  const FactorColumns& factor_;
  int first_, n_;
  PanelProduct multiply_;
  std::vector<int> place_, rows_;  // rows_: I; place_: where a row is in it, while it is made
  MatrixXd z_, top_, p_, below_, root_, corner_;
  std::vector<double> tiles_, panel_;
};

}  // namespace

MatrixXd corner_inverse(const FactorColumns& factor, int first, PanelProduct product) {
  return CornerInverse(factor, first, product).run();
}

}  // namespace field_core
