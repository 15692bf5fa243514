#include "selected_inverse.hpp"

#include <Eigen/Core>
#include <cstddef>

namespace field_core {
namespace {

using Eigen::MatrixXd;
using Vector = Eigen::Map<const Eigen::VectorXd>;

int count(const FactorColumns& factor, int j) { return factor.start[j + 1] - factor.start[j]; }

/// Whether column j has the rows of the next one, and that one's diagonal.
bool goes_on(const FactorColumns& factor, int j) {
  return count(factor, j) == count(factor, j + 1) + 1 && factor.row[factor.start[j] + 1] == j + 1;
}

/// Columns first .. end - 1, which have their rows I below `end` in common.
class Node {
 public:
  Node(const FactorColumns& factor, int first, int end)
      : factor_(factor),
        first_(first),
        width_(end - first),
        height_(count(factor, end - 1) - 1),
        rows_(factor.row + factor.start[end - 1] + 1) {}

  /// @param place -1 for every row of the factor, before and after
  /// @param z later columns are those of the inverse already, these become so
  void invert(std::vector<int>& place, double* z) const {
    MatrixXd l = MatrixXd::Zero(width_, width_), y(height_, width_);  // L_JJ, L_IJ
    for (int c = 0; c < width_; ++c) {
      const double* column = z + factor_.start[first_ + c];
      l.col(c).tail(width_ - c) = Vector(column, width_ - c);
      y.col(c) = Vector(column + width_ - c, height_);
    }
    const auto lower = l.triangularView<Eigen::Lower>();
    MatrixXd inverse = MatrixXd::Identity(width_, width_);
    lower.solveInPlace(inverse);
    lower.solveInPlace<Eigen::OnTheRight>(y);
    MatrixXd below(height_, width_);
    if (height_ > 0) below = -(gather(place, z).selfadjointView<Eigen::Lower>() * y);
    const MatrixXd diagonal = inverse.transpose() * inverse - y.transpose() * below;
    for (int c = 0; c < width_; ++c) {
      double* column = z + factor_.start[first_ + c];
      for (int a = c; a < width_; ++a) *column++ = diagonal(a, c);
      for (int a = 0; a < height_; ++a) *column++ = below(a, c);
    }
  }

 private:
  /// Z_II, lower triangle.
  MatrixXd gather(std::vector<int>& place, const double* z) const {
    MatrixXd out = MatrixXd::Zero(height_, height_);
    for (int k = 0; k < height_; ++k) place[static_cast<std::size_t>(rows_[k])] = k;
    for (int k = 0; k < height_; ++k) {
      const int column = rows_[k];
      for (int p = factor_.start[column]; p < factor_.start[column + 1]; ++p) {
        const int at = place[static_cast<std::size_t>(factor_.row[p])];
        if (at >= 0) out(at, k) = z[p];
      }
    }
    for (int k = 0; k < height_; ++k) place[static_cast<std::size_t>(rows_[k])] = -1;
    return out;
  }

  const FactorColumns& factor_;
  int first_, width_, height_;
  const int* rows_;
};

}  // namespace

void selected_inverse(const FactorColumns& factor, double* values) {
  std::vector<int> place(static_cast<std::size_t>(factor.n), -1);
  for (int end = factor.n; end > 0;) {
    int first = end - 1;
    while (first > 0 && goes_on(factor, first - 1)) --first;
    Node(factor, first, end).invert(place, values);
    end = first;
  }
}

}  // namespace field_core
