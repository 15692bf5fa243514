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
  const int field = basis.field_of(point);
  const double unexplained = basis.prior(field, field) - dot_product(phi, phi, m_);
  at.mean = dot_product(phi, closed.mean(), m_);
  at.variance = std::max(0.0, unexplained) + dot_product(phi, at.gain.data(), m_);
  double* q = at.covariances.data();
  for (int i = 0; i < padded(); ++i) q[i] = basis.prior(i < open_ ? field_of(basis, i) : 0, field);
  open_covariances({kernel.type(), q, kernel.dimensions(), kernel.length_scales().data(), m_, open_,
                    padded(), coordinates(0), gains()},
                   point.data(), phi, q);
  at.rows = 0;
  at.recent_mean = at.mean;
  at.recent_variance = at.variance;
  condition(at);
  if (recent == Recent::ignored) return;
  at.mean = at.recent_mean;
  at.variance = at.recent_variance;
}

void OpenSlice::condition(Evaluation& at) const {
  double* q = at.covariances.data();
  double mean = at.recent_mean, variance = at.recent_variance;
  for (int i = at.rows; i < open_; ++i) {
    const double* f = factor(i);
    double rest = q[i];
    for (int j = 0; j < i; ++j) rest -= f[j] * q[j];
    q[i] = rest * f[i];
    mean += q[i] * head(i)[0];
    variance -= q[i] * q[i];
  }
  at.recent_mean = mean;
  at.recent_variance = std::max(0.0, variance);  // below zero by rounding only
  at.rows = open_;
}

void OpenSlice::update(const SupportBasis& basis, const Place& point, const double* phi,
                       Evaluation& at) const {
  const auto& kernel = basis.kernel();
  const int field = basis.field_of(point), d = kernel.dimensions();
  for (int i = at.rows; i < open_; ++i) {
    const double r2 =
        (this->point(i) - point).head(d).cwiseQuotient(kernel.length_scales()).squaredNorm();
    at.covariances[i] =
        basis.prior(field_of(basis, i), field) * field_core::correlation(kernel.type(), r2) -
        dot_product(gains() + i * m_, phi, m_);
  }
  condition(at);
}

double OpenSlice::covariance(double prior, const double* phi_a, const Evaluation& a,
                             const double* phi_b, const Evaluation& b, Recent recent) const {
  double sum = prior - dot_product(phi_a, phi_b, m_) + dot_product(a.gain.data(), phi_b, m_);
  const int rows = recent == Recent::used ? std::min(a.rows, b.rows) : 0;
  for (int i = 0; i < rows; ++i) sum -= a.covariances[i] * b.covariances[i];
  return sum;
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
  for (int i = 0; i < open_; ++i) {
    basis.add_newest_features(point(i), numbers_.data() + (features(i) - numbers_.data()));
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
