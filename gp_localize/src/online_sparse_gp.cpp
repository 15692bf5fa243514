#include "gp_localize/online_sparse_gp.hpp"

#include <algorithm>

namespace gp_localize {
namespace {

/// phi in one piece: where it is, or gathered into `at`.
const double* contiguous(const double* phi, Eigen::Index stride, int size, Evaluation& at) {
  if (stride == 1) return phi;
  at.features.resize(size);
  for (int k = 0; k < size; ++k) at.features[k] = phi[k * stride];
  return at.features.data();
}

}  // namespace

void OnlineSparseGp::evaluate(const SupportBasis& basis, const Place& point, const double* phi,
                              Eigen::Index stride, Evaluation& at) const {
  slice_.evaluate(basis, closed_, point, contiguous(phi, stride, support_size(), at), recent_, at);
}

void OnlineSparseGp::append(const Place& point, const double* phi, Eigen::Index stride,
                            Evaluation& at, double value, double noise_variance) {
  slice_.append(point, contiguous(phi, stride, support_size(), at), at, value, noise_variance);
  if (slice_.full()) end_slice();
}

std::size_t OnlineSparseGp::number_count(int m, int slice_size, int dimensions) {
  return 1 + SupportPosterior::size(m) + OpenSlice::number_count(m, slice_size, dimensions);
}

std::vector<double> OnlineSparseGp::numbers() const {
  std::vector<double> all(summary(), summary() + summary_size(support_size()));
  all.insert(all.end(), slice_.numbers().begin(), slice_.numbers().end());
  all.push_back(open());
  return all;
}

void OnlineSparseGp::restore(const double* numbers) {
  const int size = summary_size(support_size());
  std::copy(numbers, numbers + size, closed_.numbers());
  const std::size_t count = OpenSlice::number_count(support_size(), slice_size_, dimensions_);
  slice_.restore(static_cast<int>(numbers[size + count]), numbers + size);
}

}  // namespace gp_localize
