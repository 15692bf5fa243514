#include "selected_inverse.hpp"

#include <cstddef>

namespace field_core {

std::vector<double> selected_inverse(const FactorColumns& factor) {
  const auto size = [](int k) { return static_cast<std::size_t>(k); };
  std::vector<double> z(size(factor.start[factor.n]));
  // Of the column at hand, by row: its entry of L (0: not in the pattern) and of Z_II L_Ij.
  std::vector<double> entry(size(factor.n), 0.0), product(size(factor.n), 0.0);
  std::vector<char> member(size(factor.n), 0);
  for (int j = factor.n - 1; j >= 0; --j) {
    const int first = factor.start[j], end = factor.start[j + 1];
    const double inverse = 1.0 / factor.value[first];
    for (int p = first + 1; p < end; ++p) {
      const std::size_t r = size(factor.row[p]);
      entry[r] = factor.value[p];
      product[r] = 0.0;
      member[r] = 1;
    }
    for (int p = first + 1; p < end; ++p) {
      const int k = factor.row[p];
      const double l_k = entry[size(k)];
      double sum = z[size(factor.start[k])] * l_k;
      for (int s = factor.start[k] + 1; s < factor.start[k + 1]; ++s) {
        const std::size_t r = size(factor.row[s]);
        if (!member[r]) continue;
        sum += z[size(s)] * entry[r];
        product[r] += z[size(s)] * l_k;
      }
      product[size(k)] += sum;
    }
    double dot = 0.0;
    for (int p = first + 1; p < end; ++p) {
      const std::size_t r = size(factor.row[p]);
      z[size(p)] = -product[r] * inverse;
      dot += entry[r] * z[size(p)];
      member[r] = 0;
    }
    z[size(first)] = (inverse - dot) * inverse;
  }
  return z;
}

}  // namespace field_core
