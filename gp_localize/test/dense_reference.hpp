// Plain dense Gaussian process regression, written from the definitions of Quinonero-Candela and
// Rasmussen (2005) with full matrices and no shared code with the library but the kernel function.
#pragma once

#include <Eigen/Dense>
#include <functional>
#include <vector>

namespace gp_localize::test {

using Covariance = std::function<double(const Eigen::Vector2d&, const Eigen::Vector2d&)>;

struct DenseField {
  Covariance k;  // noise-free
  Eigen::Matrix2Xd support;
  double support_diagonal;  // added to Sigma_SS: jitter, or noise for the paper's literal form
  double noise_variance;
};

struct Moments {
  double mean, variance;  // of the noise-free field
};

inline Eigen::MatrixXd gram(const Covariance& k, const Eigen::Matrix2Xd& a,
                            const Eigen::Matrix2Xd& b) {
  Eigen::MatrixXd m(a.cols(), b.cols());
  for (Eigen::Index i = 0; i < a.cols(); ++i) {
    for (Eigen::Index j = 0; j < b.cols(); ++j) m(i, j) = k(a.col(i), b.col(j));
  }
  return m;
}

/// Gamma_AB = Sigma_AS Sigma_SS^-1 Sigma_SB.
inline Eigen::MatrixXd gamma(const DenseField& f, const Eigen::Matrix2Xd& a,
                             const Eigen::Matrix2Xd& b) {
  Eigen::MatrixXd ss = gram(f.k, f.support, f.support);
  ss.diagonal().array() += f.support_diagonal;
  return gram(f.k, a, f.support) * ss.ldlt().solve(gram(f.k, f.support, b));
}

/// Regression whose training covariance is Gamma plus, inside each block of equal labels, what
/// Gamma leaves out. A query with label `query_block` is in that block (PIC); -1: in none (PITC).
inline Moments block_regression(const DenseField& f, const Eigen::Matrix2Xd& x,
                                const Eigen::VectorXd& z, const std::vector<int>& block,
                                const Eigen::Vector2d& query, int query_block) {
  const Eigen::Index n = x.cols();
  Eigen::MatrixXd cov = gamma(f, x, x);
  Eigen::VectorXd cross = gamma(f, x, query);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      if (block[i] == block[j]) cov(i, j) = f.k(x.col(i), x.col(j));
    }
    cov(i, i) += f.noise_variance;
    if (block[i] == query_block) cross[i] = f.k(x.col(i), query);
  }
  if (n == 0) return {0.0, f.k(query, query)};
  const Eigen::LDLT<Eigen::MatrixXd> factor(cov);
  return {cross.dot(factor.solve(z)), f.k(query, query) - cross.dot(factor.solve(cross))};
}

}  // namespace gp_localize::test
