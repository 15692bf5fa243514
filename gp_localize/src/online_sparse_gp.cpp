#include "gp_localize/online_sparse_gp.hpp"

#include <algorithm>
#include <cmath>

#include "vector_kernels.hpp"

namespace gp_localize {
namespace {

double dot(const double* a, const double* b, int n) {
  return Eigen::Map<const Eigen::VectorXd>(a, n).dot(Eigen::Map<const Eigen::VectorXd>(b, n));
}

void subtract_multiple(double factor, const double* from, int n, double* to) {
  Eigen::Map<Eigen::VectorXd>(to, n) -= factor * Eigen::Map<const Eigen::VectorXd>(from, n);
}

}  // namespace

OnlineSparseGp::OnlineSparseGp(int support_size, int slice_size, Recent recent)
    : m_(support_size),
      slice_size_(slice_size),
      recent_(recent),
      data_(number_count(support_size, slice_size) - 1, 0.0) {
  double* a = data_.data();
  for (int j = 0; j < m_; a += m_ - j, ++j) a[0] = 1.0;
}

std::size_t OnlineSparseGp::number_count(int m, int slice_size) {
  return 1 + m * (m + 1) / 2 + m +
         static_cast<std::size_t>(slice_size) * (kRowHead + 2 * m + slice_size);
}

void OnlineSparseGp::evaluate(const SupportBasis& basis, const Eigen::Vector2d& point,
                              const double* phi, Eigen::Index stride, Evaluation& at) const {
  at.covariances.resize(slice_size_);
  at.features.resize(m_);
  at.gain.resize(m_);
  double* p = at.features.data();
  for (int k = 0; k < m_; ++k) p[k] = phi[k * stride];
  const double open_to_support = basis.kernel().signal_variance() - dot(p, p, m_);
  if (recent_ == Recent::ignored) {
    at.mean = dot(p, mean(), m_);
    symmetric_multiply(covariance(), m_, p, at.gain.data());
    at.variance = std::max(0.0, open_to_support) + dot(p, at.gain.data(), m_);
  }
  // p shrinks in place below, so Sigma_{D'x|S} takes its phi^T phi terms first.
  for (int i = 0; i < open_; ++i) {
    at.covariances[i] = basis.kernel()(open_point(i), point) - dot(open_features(i), p, m_);
  }
  at.unexplained = open_to_support;
  double recent_mean = 0.0;
  for (int i = 0; i < open_; ++i) {
    const double* f = row(i) + kRowHead + 2 * m_;
    const double w = (at.covariances[i] - dot(f, at.covariances.data(), i)) / f[i];
    at.covariances[i] = w;
    at.unexplained -= w * w;
    recent_mean += w * row(i)[2];
    subtract_multiple(w, row(i) + kRowHead, m_, p);
  }
  at.unexplained = std::max(0.0, at.unexplained);  // below zero by rounding only
  if (recent_ == Recent::ignored) return;
  at.mean = recent_mean + dot(p, mean(), m_);
  symmetric_multiply(covariance(), m_, p, at.gain.data());
  at.variance = at.unexplained + dot(p, at.gain.data(), m_);
}

void OnlineSparseGp::append(const Eigen::Vector2d& point, const double* phi, Eigen::Index stride,
                            Evaluation& at, double value, double noise_variance) {
  double* r = row(open_);
  double* v = r + kRowHead;
  const double pivot = std::sqrt(at.unexplained + noise_variance);
  double whitened = value;
  for (int j = 0; j < open_; ++j) whitened -= at.covariances[j] * row(j)[2];
  r[0] = point.x();
  r[1] = point.y();
  r[2] = whitened / pivot;
  r[3] = value;
  r[4] = noise_variance;
  for (int k = 0; k < m_; ++k) {
    v[k] = at.features[k] / pivot;
    v[m_ + k] = phi[k * stride];
  }
  double* f = v + 2 * m_;
  std::copy(at.covariances.begin(), at.covariances.begin() + open_, f);
  f[open_] = pivot;
  ++open_;
  if (recent_ == Recent::used) {
    for (double& g : at.gain) g /= pivot;  // A p becomes A v
    assimilate(r[2], v, at.gain.data());
  }
  if (open_ == slice_size_) end_slice();
}

/// A <- A - g g^T / (1 + v^T g), m <- m + g (y - v^T m) / (1 + v^T g) with g = A v: the matrix
/// inversion lemma for the precision I + ... + v v^T.
void OnlineSparseGp::assimilate(double y, const double* v, const double* gain) {
  double* m = data_.data() + packed();
  const double spread = 1.0 + dot(v, gain, m_);
  const double surprise = (y - dot(v, m, m_)) / spread;
  subtract_multiple(-surprise, gain, m_, m);
  symmetric_downdate(data_.data(), m_, 1.0 / spread, gain);
}

void OnlineSparseGp::end_slice() {
  if (recent_ == Recent::ignored) {
    for (int i = 0; i < open_; ++i) {
      const double* v = row(i) + kRowHead;
      // The features of a closed row are not read again: their place serves as A v.
      double* gain = row(i) + kRowHead + m_;
      symmetric_multiply(covariance(), m_, v, gain);
      assimilate(row(i)[2], v, gain);
    }
  }
  open_ = 0;
}

/// The inverse of assimilate(), newest row first: with g = A v of the A that has the row in it,
/// A_before = A + g g^T / (1 - v^T g) and m_before = m - g (y - v^T m) / (1 - v^T g).
void OnlineSparseGp::closed_summary(double* out) const {
  std::copy(data_.begin(), data_.begin() + summary_size(m_), out);
  if (recent_ == Recent::ignored) return;
  std::vector<double> gain(m_);
  double* m = out + packed();
  for (int i = open_ - 1; i >= 0; --i) {
    const double* v = row(i) + kRowHead;
    symmetric_multiply(out, m_, v, gain.data());
    const double rest = 1.0 - dot(v, gain.data(), m_);
    subtract_multiple((row(i)[2] - dot(v, m, m_)) / rest, gain.data(), m_, m);
    symmetric_downdate(out, m_, -1.0 / rest, gain.data());
  }
}

std::vector<double> OnlineSparseGp::numbers() const {
  std::vector<double> all(data_);
  all.push_back(open_);
  return all;
}

void OnlineSparseGp::restore(const double* numbers) {
  std::copy(numbers, numbers + data_.size(), data_.begin());
  open_ = static_cast<int>(numbers[data_.size()]);
}

}  // namespace gp_localize
