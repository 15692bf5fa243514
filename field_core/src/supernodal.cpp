#include "supernodal.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace field_core {
namespace {

std::size_t at(long k) { return static_cast<std::size_t>(k); }

/// C = X Y^T by panels and tiles, Y the first `columns` rows of X.
class OuterProduct {
 public:
  explicit OuterProduct(PanelProduct product) : product_(product) {}

  /// X: rows x depth, column-major with stride ld. Then visit(i0, height, j0, width, tile) for the
  /// tiles (kPanelHeight x kTileWidth, column-major) that reach into the lower triangle.
  template <typename Visit>
  void run(const double* x, long ld, int rows, int columns, int depth, const Visit& visit) {
    pack<kTileWidth>(x, ld, columns, depth, tiles_);
    pack<kPanelHeight>(x, ld, rows, depth, panels_);
    for (int i0 = 0; i0 < rows; i0 += kPanelHeight) {
      const int height = std::min(kPanelHeight, rows - i0);
      for (int j0 = 0; j0 < std::min(columns, i0 + height); j0 += kTileWidth) {
        alignas(64) double out[kPanelHeight * kTileWidth];
        product_(depth, panels_.data() + static_cast<long>(i0) * depth,
                 tiles_.data() + static_cast<long>(j0) * depth, out);
        visit(i0, height, j0, std::min(kTileWidth, columns - j0), out);
      }
    }
  }

 private:
  template <int Height>
  static void pack(const double* x, long ld, int rows, int depth, std::vector<double>& out) {
    const int count = (rows + Height - 1) / Height;
    const long size = static_cast<long>(count) * Height * depth;
    if (static_cast<long>(out.size()) < size) out.resize(at(size));
    double* to = out.data();
    for (int i0 = 0; i0 < rows; i0 += Height) {
      const int height = std::min(Height, rows - i0);
      for (int k = 0; k < depth; ++k, to += Height) {
        const double* from = x + k * ld + i0;
        if (height == Height) {
          std::copy(from, from + Height, to);
        } else {
          std::fill(std::copy(from, from + height, to), to + Height, 0.0);
        }
      }
    }
  }

  PanelProduct product_;
  std::vector<double> panels_, tiles_;
};

class Factorization {
 public:
  Factorization(const Supernodes& nodes, const FactorColumns& a, double* x, PanelProduct product)
      : nodes_(nodes),
        a_(a),
        x_(x),
        outer_(product),
        node_of_(at(nodes.n)),
        map_(at(nodes.n)),
        head_(at(nodes.count), -1),
        next_(at(nodes.count), -1),
        position_(at(nodes.count), 0) {
    for (int k = 0; k < nodes.count; ++k) {
      for (int j = nodes.super[k]; j < nodes.super[k + 1]; ++j) node_of_[at(j)] = k;
    }
  }

  int run() {
    for (int k = 0; k < nodes_.count; ++k) {
      assemble(k);
      for (int d = head_[at(k)]; d >= 0;) {
        const int following = next_[at(d)];
        subtract(d, k);
        d = following;
      }
      const int failed = eliminate(k);
      if (failed < columns(k)) return nodes_.super[k] + failed;
      position_[at(k)] = columns(k);
      link(k);
    }
    return nodes_.n;
  }

 private:
  int columns(int k) const { return nodes_.super[k + 1] - nodes_.super[k]; }
  int rows(int k) const { return nodes_.pi[k + 1] - nodes_.pi[k]; }
  const int* row_list(int k) const { return nodes_.s + nodes_.pi[k]; }
  double* block(int k) const { return x_ + nodes_.px[k]; }

  /// The columns of A, and where each row is in the block.
  void assemble(int k) {
    const int first = nodes_.super[k];
    const long ld = rows(k);
    for (int i = 0; i < ld; ++i) map_[at(row_list(k)[i])] = i;
    std::fill(block(k), block(k) + ld * columns(k), 0.0);
    for (int j = first; j < nodes_.super[k + 1]; ++j) {
      double* to = block(k) + (j - first) * ld;
      for (int p = a_.start[j]; p < a_.start[j + 1]; ++p) to[map_[at(a_.row[p])]] += a_.value[p];
    }
  }

  /// What an earlier supernode takes from the block of k; then it waits for the next one.
  void subtract(int d, int k) {
    const int from = position_[at(d)], all = rows(d);
    const int* list = row_list(d);
    int inside = from;  // its rows that are columns of k
    while (inside < all && list[inside] < nodes_.super[k + 1]) ++inside;
    const long ld = rows(k);
    double* to = block(k);
    place_.resize(at(std::max<long>(static_cast<long>(place_.size()), all)));
    for (int i = from; i < all; ++i) place_[at(i - from)] = map_[at(list[i])];
    const auto scatter = [&](int i0, int height, int j0, int width, const double* tile) {
      for (int c = 0; c < width; ++c, tile += kPanelHeight) {
        double* column = to + place_[at(j0 + c)] * ld;
        for (int i = std::max(0, j0 + c - i0); i < height; ++i)
          column[place_[at(i0 + i)]] -= tile[i];
      }
    };
    outer_.run(block(d) + from, all, all - from, inside - from, columns(d), scatter);
    position_[at(d)] = inside;
    link(d);
  }

  /// Dense Cholesky factorization of the block of k. Returns its first bad column.
  int eliminate(int k) {
    const int width = columns(k), height = rows(k);
    const long ld = height;
    double* l = block(k);
    for (int j0 = 0; j0 < width; j0 += kStrip) {
      const int j1 = std::min(j0 + kStrip, width);
      const int failed = eliminate_strip(l, ld, height, j0, j1);
      if (failed < j1) return failed;
      const auto downdate = [&](int i0, int size, int c0, int count, const double* tile) {
        for (int c = 0; c < count; ++c, tile += kPanelHeight) {
          const int first = std::max(0, c0 + c - i0);
          double* column = l + (j1 + c0 + c) * ld + j1 + i0;
          for (int i = first; i < size; ++i) column[i] -= tile[i];
        }
      };
      if (j1 < width) {
        outer_.run(l + j0 * ld + j1, ld, height - j1, width - j1, j1 - j0, downdate);
      }
    }
    return width;
  }

  static int eliminate_strip(double* l, long ld, int height, int j0, int j1) {
    for (int j = j0; j < j1; ++j) {
      double* column = l + j * ld;
      for (int c = j0; c < j; ++c) {
        const double* other = l + c * ld;
        const double factor = other[j];
        for (int i = j; i < height; ++i) column[i] -= factor * other[i];
      }
      if (!(column[j] > 0.0)) return j;
      const double root = std::sqrt(column[j]), inverse = 1.0 / root;
      column[j] = root;
      for (int i = j + 1; i < height; ++i) column[i] *= inverse;
    }
    return j1;
  }

  /// Into the list of the supernode that owns its next row.
  void link(int d) {
    if (position_[at(d)] >= rows(d)) return;
    int& head = head_[at(node_of_[at(row_list(d)[position_[at(d)]])])];
    next_[at(d)] = head;
    head = d;
  }

  static constexpr int kStrip = 24;
  const Supernodes& nodes_;
  const FactorColumns& a_;
  double* x_;
  OuterProduct outer_;
  std::vector<int> node_of_, map_, place_;
  // Supernodes that still have something to take from k: head_[k], then next_; position_: how many
  // of their rows are done.
  std::vector<int> head_, next_, position_;
};

}  // namespace

int factorize_supernodes(const Supernodes& nodes, const FactorColumns& a, double* x,
                         PanelProduct product) {
  return Factorization(nodes, a, x, product).run();
}

}  // namespace field_core
