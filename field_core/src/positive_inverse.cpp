#include "field_core/positive_inverse.hpp"

#include <vector>

#include "corner_inverse.hpp"
#include "supernodal.hpp"

namespace field_core {

Eigen::MatrixXd positive_inverse(const Eigen::MatrixXd& lower) {
  const int n = static_cast<int>(lower.cols());
  if (n == 0) return {};
  // Compressed columns of a full lower triangle, for the matrix and for its factor.
  std::vector<int> start{0}, row;
  std::vector<double> value;
  for (int j = 0; j < n; ++j) {
    for (int i = j; i < n; ++i) {
      row.push_back(i);
      value.push_back(lower(i, j));
    }
    start.push_back(static_cast<int>(row.size()));
  }
  const std::vector<int> super{0, n}, pi{0, n}, px{0, n * n};
  std::vector<double> x(static_cast<std::size_t>(n) * static_cast<std::size_t>(n));
  const FactorColumns a{n, start.data(), row.data(), value.data()};
  // The rows of the one supernode are those of the first column.
  const Supernodes node{n, 1, super.data(), pi.data(), px.data(), row.data()};
  if (factorize_supernodes(node, a, x.data()) < n) return {};
  std::size_t to = 0;
  for (int j = 0; j < n; ++j) {
    for (int i = j; i < n; ++i)
      value[to++] = x[static_cast<std::size_t>(j) * static_cast<std::size_t>(n) +
                      static_cast<std::size_t>(i)];
  }
  return corner_inverse(a, 0);
}

}  // namespace field_core
