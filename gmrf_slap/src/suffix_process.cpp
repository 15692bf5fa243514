#include "suffix_process.hpp"

#include <algorithm>
#include <cmath>

namespace gmrf_slap {
namespace {
constexpr double kLogTwoPi = 1.8378770664093454836;
using ConstVector = Eigen::Map<const Eigen::VectorXd>;
}  // namespace

SuffixProcess::SuffixProcess(int capacity, int hypotheses)
    : rows_(static_cast<std::size_t>(capacity)),
      residuals_(Eigen::VectorXd::Zero(capacity)),
      noises_(Eigen::VectorXd::Zero(capacity)),
      evidence_(Eigen::VectorXd::Zero(hypotheses)),
      factors_(static_cast<std::size_t>(hypotheses)) {
  for (Factor& f : factors_) {
    // One row more than can be held: the row of a prediction.
    f.rows.resize(static_cast<std::size_t>(capacity + 1) * static_cast<std::size_t>(capacity + 2) /
                  2);
    f.white = Eigen::VectorXd::Zero(capacity);
  }
}

SuffixProcess::Prediction SuffixProcess::predict(int l, const FieldMixture& field,
                                                 const SiteRow& row) {
  const auto at = static_cast<std::size_t>(l);
  Factor& f = factors_[at];
  const GaussianField& base = *field.given[at];
  double* v = factor_row(f, size_);
  if (row.count == 0) {
    std::fill(v, v + size_, 0.0);
    return f.next = {0.0, field.prior_variance[at]};
  }
  Prediction next;
  base.predict(&row, 1, &next.mean, &next.variance);
  base.covariances(row, rows_.data(), size_, v);
  for (int i = 0; i < size_; ++i) {
    const double* fi = factor_row(f, i);
    v[i] = (v[i] - ConstVector(fi, i).dot(ConstVector(v, i))) / fi[i];
  }
  const ConstVector known(v, size_);
  next.mean += known.dot(f.white.head(size_));
  // Non-negative in exact arithmetic; a place measured many times comes close to 0.
  next.variance = std::max(next.variance - known.squaredNorm(), 0.0);
  return f.next = next;
}

void SuffixProcess::append_to(int l, double residual, double noise) {
  Factor& f = factors_[static_cast<std::size_t>(l)];
  const double s = f.next.variance + noise, root = std::sqrt(s);
  const double y = (residual - f.next.mean) / root;
  factor_row(f, size_)[size_] = root;
  f.white[size_] = y;
  evidence_[l] -= 0.5 * (y * y + std::log(s) + kLogTwoPi);
}

void SuffixProcess::append(const SiteRow& row, double residual, double noise) {
  for (int l = 0; l < static_cast<int>(factors_.size()); ++l) append_to(l, residual, noise);
  rows_[static_cast<std::size_t>(size_)] = row;
  residuals_[size_] = residual;
  noises_[size_] = noise;
  ++size_;
}

void SuffixProcess::rebuild(int count, const FieldMixture& field) {
  const int left = size_ - count;
  std::copy(rows_.begin() + count, rows_.begin() + size_, rows_.begin());
  std::copy(residuals_.data() + count, residuals_.data() + size_, residuals_.data());
  std::copy(noises_.data() + count, noises_.data() + size_, noises_.data());
  evidence_.setZero();
  for (int l = 0; l < static_cast<int>(factors_.size()); ++l) {
    for (size_ = 0; size_ < left; ++size_) {
      predict(l, field, row(size_));
      append_to(l, residuals_[size_], noises_[size_]);
    }
  }
  size_ = left;
}

void SuffixProcess::copy_from(const SuffixProcess& other) {
  size_ = other.size_;
  std::copy(other.rows_.begin(), other.rows_.begin() + size_, rows_.begin());
  residuals_.head(size_) = other.residuals_.head(size_);
  noises_.head(size_) = other.noises_.head(size_);
  evidence_ = other.evidence_;
  for (std::size_t l = 0; l < factors_.size(); ++l) {
    const Factor& from = other.factors_[l];
    const long used = static_cast<long>(size_) * (size_ + 1) / 2;
    std::copy(from.rows.begin(), from.rows.begin() + used, factors_[l].rows.begin());
    factors_[l].white.head(size_) = from.white.head(size_);
    factors_[l].next = from.next;
  }
}

void SuffixProcess::add_site_weights(int l, double scale, Eigen::VectorXd& weights) const {
  const Factor& f = factors_[static_cast<std::size_t>(l)];
  Eigen::VectorXd x = f.white.head(size_);
  for (int i = size_ - 1; i >= 0; --i) {
    const double* fi = f.rows.data() + static_cast<long>(i) * (i + 1) / 2;
    x[i] /= fi[i];
    x.head(i) -= x[i] * ConstVector(fi, i);
  }
  for (int i = 0; i < size_; ++i) {
    const SiteRow& row = rows_[static_cast<std::size_t>(i)];
    for (std::size_t a = 0; a < static_cast<std::size_t>(row.count); ++a) {
      weights[row.site[a]] += scale * x[i] * row.weight[a];
    }
  }
}

}  // namespace gmrf_slap
