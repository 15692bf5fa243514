// Plain dense regression over places x fields with the full joint covariance, from the definition
// of the intrinsic coregionalization model; shares no code with the library.
#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <vector>

namespace gp_localize::test {

struct Read {
  Eigen::Vector2d x;
  int field;
  double value, noise_variance;
  int block;  // slice
};

struct JointMoments {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;  // noise-free
};

struct CorrelatedFields {
  Eigen::MatrixXd b;  // covariance between the fields at one place
  Eigen::Vector2d lengths;
  Eigen::Matrix2Xd support;
  double jitter = 0.0;

  double k(const Eigen::Vector2d& x, int f, const Eigen::Vector2d& y, int g) const {
    return b(f, g) * std::exp(-0.5 * (x - y).cwiseQuotient(lengths).squaredNorm());
  }
  /// Of (place, field) with the support: all points of field 0, then of field 1, ...
  Eigen::RowVectorXd with_support(const Eigen::Vector2d& x, int f) const {
    Eigen::RowVectorXd row(support.cols() * b.rows());
    for (Eigen::Index i = 0; i < row.size(); ++i) {
      row[i] = k(x, f, support.col(i % support.cols()), static_cast<int>(i / support.cols()));
    }
    return row;
  }
  Eigen::MatrixXd support_covariance() const {
    const Eigen::Index m = support.cols();
    Eigen::MatrixXd ss(m * b.rows(), m * b.rows());
    for (Eigen::Index i = 0; i < ss.rows(); ++i) {
      const auto f = static_cast<int>(i / m);
      ss.row(i) = with_support(support.col(i % m), f);
      for (Eigen::Index g = 0; g < b.rows(); ++g) ss(i, g * m + i % m) += jitter * b(f, g);
    }
    return ss;
  }

  /// Joint moments of `fields` at `query`, PITC between blocks and exact inside them; the query is
  /// in block `query_block`, or in none (-1).
  JointMoments regress(const std::vector<Read>& reads, const Eigen::Vector2d& query,
                       const std::vector<int>& fields, int query_block) const {
    const auto n = static_cast<Eigen::Index>(reads.size());
    const auto q = static_cast<Eigen::Index>(fields.size());
    Eigen::MatrixXd to_support(n, support.cols() * b.rows()), cov(n, n), cross(n, q), prior(q, q);
    for (Eigen::Index i = 0; i < n; ++i)
      to_support.row(i) = with_support(reads[i].x, reads[i].field);
    const Eigen::LDLT<Eigen::MatrixXd> ss(support_covariance());
    cov = to_support * ss.solve(to_support.transpose());
    Eigen::VectorXd z(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      z[i] = reads[i].value;
      for (Eigen::Index j = 0; j < n; ++j) {
        if (reads[i].block != reads[j].block) continue;
        cov(i, j) = k(reads[i].x, reads[i].field, reads[j].x, reads[j].field);
      }
      cov(i, i) += reads[i].noise_variance;
    }
    for (Eigen::Index a = 0; a < q; ++a) {
      cross.col(a) = to_support * ss.solve(with_support(query, fields[a]).transpose());
      for (Eigen::Index i = 0; i < n; ++i) {
        if (reads[i].block == query_block)
          cross(i, a) = k(reads[i].x, reads[i].field, query, fields[a]);
      }
      for (Eigen::Index c = 0; c < q; ++c) prior(a, c) = k(query, fields[a], query, fields[c]);
    }
    if (n == 0) return {Eigen::VectorXd::Zero(q), prior};
    const Eigen::LDLT<Eigen::MatrixXd> factor(cov);
    return {cross.transpose() * factor.solve(z), prior - cross.transpose() * factor.solve(cross)};
  }
};

/// log N(z; m) + n log(2 pi) / 2, with noise on the diagonal.
inline double log_density(JointMoments m, const Eigen::VectorXd& z, const Eigen::VectorXd& noise) {
  m.covariance.diagonal() += noise;
  const Eigen::LDLT<Eigen::MatrixXd> factor(m.covariance);
  const Eigen::VectorXd error = z - m.mean;
  return -0.5 * (error.dot(factor.solve(error)) + factor.vectorD().array().log().sum());
}

}  // namespace gp_localize::test
