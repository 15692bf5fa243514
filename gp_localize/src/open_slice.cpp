#include "gp_localize/open_slice.hpp"

#include <algorithm>
#include <cmath>

#include "packed_symmetric.hpp"

namespace gp_localize {

SupportPosterior::SupportPosterior(int support_size)
    : m_(support_size), numbers_(size(support_size), 0.0) {
  double* a = numbers_.data();
  for (int j = 0; j < m_; a += m_ - j, ++j) a[0] = 1.0;
}

OpenSlice::OpenSlice(int support_size, int slice_size, int dimensions)
    : m_(support_size),
      slice_size_(slice_size),
      dimensions_(dimensions),
      numbers_(number_count(support_size, slice_size, dimensions), 0.0) {}

std::size_t OpenSlice::number_count(int m, int slice_size, int dimensions) {
  return static_cast<std::size_t>(dimensions) * ((slice_size + 3) / 4 * 4) +
         static_cast<std::size_t>(slice_size) * (kHead + slice_size + 2 * m);
}

Place OpenSlice::point(int i) const {
  Place place(dimensions_);
  for (int axis = 0; axis < dimensions_; ++axis) place[axis] = coordinates(axis)[i];
  return place;
}

void OpenSlice::evaluate(const SupportBasis& basis, const SupportPosterior& closed,
                         const Place& point, const double* phi, Recent recent,
                         Evaluation& at) const {
  at.covariances.resize(padded());
  at.gain.resize(m_);
  const auto& kernel = basis.kernel();
  packed_multiply(closed.covariance(), m_, phi, at.gain.data());
  const double unexplained = kernel.signal_variance() - dot_product(phi, phi, m_);
  at.mean = dot_product(phi, closed.mean(), m_);
  at.variance = std::max(0.0, unexplained) + dot_product(phi, at.gain.data(), m_);
  double* q = at.covariances.data();
  open_covariances({kernel.type(), kernel.signal_variance(), dimensions_,
                    kernel.length_scales().data(), m_, open_, padded(), coordinates(0), gains()},
                   point.data(), phi, q);
  double mean = at.mean, variance = at.variance;
  for (int i = 0; i < open_; ++i) {
    const double* f = factor(i);
    double rest = q[i];
    for (int j = 0; j < i; ++j) rest -= f[j] * q[j];
    q[i] = rest * f[i];
    mean += q[i] * head(i)[0];
    variance -= q[i] * q[i];
  }
  at.recent_mean = mean;
  at.recent_variance = std::max(0.0, variance);  // below zero by rounding only
  if (recent == Recent::ignored) return;
  at.mean = at.recent_mean;
  at.variance = at.recent_variance;
}

void OpenSlice::append(const Place& point, const double* phi, const Evaluation& at, double value,
                       double noise_variance) {
  double* all = numbers_.data();
  const auto mine = [this, all](const double* part) { return all + (part - numbers_.data()); };
  const double pivot = std::sqrt(at.recent_variance + noise_variance);
  for (int axis = 0; axis < dimensions_; ++axis) mine(coordinates(axis))[open_] = point[axis];
  double* h = mine(head(open_));
  h[0] = (value - at.recent_mean) / pivot;
  h[1] = value;
  h[2] = noise_variance;
  double* f = mine(factor(open_));
  std::copy(at.covariances.begin(), at.covariances.begin() + open_, f);
  f[open_] = 1.0 / pivot;
  double* gain = mine(gains()) + open_ * m_;
  for (int k = 0; k < m_; ++k) gain[k] = phi[k] - at.gain[k];
  std::copy(phi, phi + m_, mine(features(open_)));
  ++open_;
}

/// With G = A Phi F^-T: A <- A - G G^T, m <- m + G y, y the whitened innovations. The rows of G
/// take the place of the gains, which a closed slice does not need.
void OpenSlice::close(const SupportPosterior& before, SupportPosterior& after) {
  double* rows = numbers_.data() + (gains() - numbers_.data());
  double* mean = after.numbers() + m_ * (m_ + 1) / 2;
  if (&before != &after) std::copy(before.mean(), before.mean() + m_, mean);
  for (int i = 0; i < open_; ++i) {
    const double *f = factor(i), *phi = features(i);
    double* g = rows + i * m_;
    for (int k = 0; k < m_; ++k) g[k] = phi[k] - g[k];  // A phi
    for (int j = 0; j < i; ++j) {
      for (int k = 0; k < m_; ++k) g[k] -= f[j] * rows[j * m_ + k];
    }
    const double scale = f[i], y = head(i)[0];
    for (int k = 0; k < m_; ++k) {
      g[k] *= scale;
      mean[k] += g[k] * y;
    }
  }
  packed_downdate(before.covariance(), m_, open_, rows, after.numbers());
  open_ = 0;
}

void OpenSlice::extend(const SupportBasis& basis) {
  const Eigen::Index newest = basis.support().cols() - 1;
  for (int i = 0; i < open_; ++i) {
    numbers_[features(i) - numbers_.data() + newest] = basis.newest_feature(point(i));
  }
}

void OpenSlice::copy_from(const OpenSlice& other) {
  open_ = other.open_;
  const double* from = other.numbers_.data();
  double* to = numbers_.data();
  const auto copy = [this, from, to](const double* part, int count) {
    const auto at = part - numbers_.data();
    std::copy(from + at, from + at + count, to + at);
  };
  for (int axis = 0; axis < dimensions_; ++axis) copy(coordinates(axis), open_);
  copy(head(0), kHead * open_);
  copy(factor(0), slice_size_ * open_);
  copy(gains(), m_ * open_);
  copy(features(0), m_ * open_);
}

void OpenSlice::restore(int open, const double* numbers) {
  open_ = open;
  std::copy(numbers, numbers + numbers_.size(), numbers_.begin());
}

}  // namespace gp_localize
