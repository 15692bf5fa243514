#include "gp_localize/marginal_likelihood.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "field_core/errors.hpp"

namespace gp_localize {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using field_core::Kernel;
using field_core::Place;
using field_core::Places;

constexpr int kLengths = 3;  // of a single field

Eigen::LLT<MatrixXd> factorize(const MatrixXd& matrix, const char* which) {
  Eigen::LLT<MatrixXd> factor(matrix);
  if (factor.info() != Eigen::Success) {
    throw field_core::NumericalError(std::string(which) +
                                     " is singular; the length scales are too long for the noise, "
                                     "or places coincide");
  }
  return factor;
}

double log_determinant(const Eigen::LLT<MatrixXd>& factor) {
  return 2.0 * factor.matrixLLT().diagonal().array().log().sum();
}

/// Covariance of fields and places: that of the fields at one place times the kernel's correlation.
class GroupKernel {
 public:
  GroupKernel(field_core::KernelType type, const Theta& theta, int fields)
      : group(theta, fields), type_(type), length_scales_(group.length_scales()) {
    Kernel(type, 1.0, length_scales_);  // for its checks
  }

  int field(const Place& place) const {
    return group.fields() > 1 ? static_cast<int>(place[length_scales_.size()]) : 0;
  }
  double variance(const Place& place) const {
    const int f = field(place);
    return group.covariance()(f, f);
  }
  MatrixXd matrix(const Places& a, const Places& b) const {
    MatrixXd k(a.cols(), b.cols());
    for (Index j = 0; j < b.cols(); ++j) {
      const int g = field(b.col(j));
      for (Index i = 0; i < a.cols(); ++i) {
        k(i, j) = group.covariance()(field(a.col(i)), g) *
                  field_core::correlation(type_, squares(a.col(i), b.col(j)).sum());
      }
    }
    return k;
  }
  VectorXd noise_variances(const Places& places) const {
    VectorXd noise(places.cols());
    for (Index i = 0; i < places.cols(); ++i) {
      const double stddev = group.noise_stddev(field(places.col(i)));
      noise[i] = stddev * stddev;
    }
    return noise;
  }
  VectorXd errors(const FieldSurvey& survey) const {
    VectorXd error = survey.values;
    for (Index i = 0; i < error.size(); ++i) error[i] -= group.mean(field(survey.places.col(i)));
    return error;
  }
  /// By axis, in length scales.
  Place squares(const Place& a, const Place& b) const {
    const Index d = length_scales_.size();
    return (a.head(d) - b.head(d)).cwiseQuotient(length_scales_).cwiseAbs2();
  }
  field_core::KernelType type() const { return type_; }

  const GroupTheta group;

 private:
  field_core::KernelType type_;
  Place length_scales_;
};

/// Collects a gradient with respect to theta.
class Gradient {
 public:
  Gradient(const GroupKernel& kernel, Index size)
      : by_theta(Theta::Zero(size)),
        kernel_(kernel),
        by_covariance_(MatrixXd::Zero(kernel.group.fields(), kernel.group.fields())) {}

  /// += factor <weights, d K / d theta> for K between the columns of a and b.
  void add(const Places& a, const Places& b, const MatrixXd& weights, double factor) {
    const Index first = kernel_.group.lengths_at();
    Place lengths = Place::Zero(by_theta.size() - first);
    for (Index j = 0; j < b.cols(); ++j) {
      const int g = kernel_.field(b.col(j));
      for (Index i = 0; i < a.cols(); ++i) {
        const int f = kernel_.field(a.col(i));
        const Place square = kernel_.squares(a.col(i), b.col(j));
        const double r2 = square.sum(), weight = factor * weights(i, j);
        by_covariance_(f, g) += weight * field_core::correlation(kernel_.type(), r2);
        lengths += weight * kernel_.group.covariance()(f, g) *
                   field_core::correlation_slope(kernel_.type(), r2) * square;
      }
    }
    by_theta.tail(lengths.size()) -= 2.0 * lengths;
  }
  /// += factor sum_i weights_i d (variance of the field of place i) / d theta
  void add_variances(const Places& places, const VectorXd& weights, double factor) {
    for (Index i = 0; i < places.cols(); ++i) {
      const int f = kernel_.field(places.col(i));
      by_covariance_(f, f) += factor * weights[i];
    }
  }
  /// += sum_i weights_i d noise variance of i / d theta
  void add_noise(const Places& places, const VectorXd& weights) {
    for (Index i = 0; i < places.cols(); ++i) {
      const int f = kernel_.field(places.col(i));
      const double stddev = kernel_.group.noise_stddev(f);
      by_theta[kernel_.group.noise_at(f)] += 2.0 * stddev * stddev * weights[i];
    }
  }
  void add_means(const Places& places, const VectorXd& alpha) {
    for (Index i = 0; i < places.cols(); ++i) {
      by_theta[kernel_.group.mean_at(kernel_.field(places.col(i)))] += alpha[i];
    }
  }
  Theta sum() const {
    Theta all = by_theta;
    kernel_.group.add_gradient(by_covariance_, all);
    return all;
  }

  Theta by_theta;

 private:
  const GroupKernel& kernel_;
  MatrixXd by_covariance_;
};

double log_density(double mahalanobis, double log_det, Index n) {
  return -0.5 * (mahalanobis + log_det + static_cast<double>(n) * std::log(2.0 * M_PI));
}

}  // namespace

Theta to_theta(const Hyperparameters& h) {
  Theta theta(kLengths + h.length_scales.size());
  theta.head<kLengths>() << h.mean, std::log(h.signal_stddev), std::log(h.noise_stddev);
  theta.tail(h.length_scales.size()) =
      h.length_scales.unaryExpr([](double length) { return std::log(length); });
  return theta;
}

Hyperparameters from_theta(const Theta& t) {
  return {t[0], std::exp(t[1]), std::exp(t[2]),
          t.tail(t.size() - kLengths).unaryExpr([](double log) { return std::exp(log); })};
}

double FullLikelihood::operator()(const Theta& theta, Theta* gradient) const {
  const GroupKernel kernel(kernel_, theta, fields_);
  const Index n = survey_.values.size();
  MatrixXd sigma = kernel.matrix(survey_.places, survey_.places);
  sigma.diagonal() += kernel.noise_variances(survey_.places);
  const auto factor = factorize(sigma, "the covariance of the measurements");
  const VectorXd error = kernel.errors(survey_);
  const VectorXd alpha = factor.solve(error);
  if (gradient) {
    MatrixXd g = -0.5 * factor.solve(MatrixXd::Identity(n, n));
    g.noalias() += 0.5 * alpha * alpha.transpose();
    Gradient sum(kernel, theta.size());
    sum.add(survey_.places, survey_.places, g, 1.0);
    sum.add_noise(survey_.places, g.diagonal());
    sum.add_means(survey_.places, alpha);
    *gradient = sum.sum();
  }
  return log_density(error.dot(alpha), log_determinant(factor), n);
}

namespace {

/// One slice of the PITC covariance.
struct Slice {
  Index begin, size;
  Eigen::LLT<MatrixXd> open;  // of Lambda_b
  MatrixXd u;                 // Lambda_b^-1 K_bu
};

/// Everything the likelihood and its gradient share.
struct PitcSystem {
  MatrixXd cross;    // K_uf
  MatrixXd weights;  // W = K_uu^-1 K_uf
  std::vector<Slice> slices;
  Eigen::LLT<MatrixXd> total;  // of B = K_uu + K_uf Lambda^-1 K_fu
  VectorXd alpha;
  double log_det;
};

PitcSystem solve(const GroupKernel& kernel, const FieldSurvey& survey, const Places& support,
                 int slice_size, double jitter, const VectorXd& error) {
  PitcSystem s;
  MatrixXd b = kernel.matrix(support, support);
  for (Index i = 0; i < support.cols(); ++i) b(i, i) += jitter * kernel.variance(support.col(i));
  const VectorXd noise = kernel.noise_variances(survey.places);
  const auto prior = factorize(b, "the covariance of the support points");
  s.cross = kernel.matrix(support, survey.places);
  s.weights = prior.solve(s.cross);
  s.log_det = -log_determinant(prior);
  s.alpha.resize(error.size());
  VectorXd projected = VectorXd::Zero(support.cols());
  for (Index begin = 0; begin < error.size(); begin += slice_size) {
    const Index size = std::min<Index>(slice_size, error.size() - begin);
    const auto places = survey.places.middleCols(begin, size);
    const auto cross = s.cross.middleCols(begin, size);
    MatrixXd lambda = kernel.matrix(places, places);
    lambda.noalias() -= cross.transpose() * s.weights.middleCols(begin, size);
    lambda.diagonal() += noise.segment(begin, size);
    Slice slice{begin, size, factorize(lambda, "the covariance of a slice"), {}};
    slice.u = slice.open.solve(cross.transpose());
    b.noalias() += cross * slice.u;
    projected.noalias() += slice.u.transpose() * error.segment(begin, size);
    s.alpha.segment(begin, size) = slice.open.solve(error.segment(begin, size));
    s.log_det += log_determinant(slice.open);
    s.slices.push_back(std::move(slice));
  }
  s.total = factorize(b, "the covariance of the support points");
  s.log_det += log_determinant(s.total);
  const VectorXd seen = s.total.solve(projected);
  for (const Slice& slice : s.slices) s.alpha.segment(slice.begin, slice.size) -= slice.u * seen;
  return s;
}

void add_pitc_gradient(const PitcSystem& s, const FieldSurvey& survey, const Places& support,
                       double jitter, Gradient& gradient) {
  const Index m = support.cols();
  MatrixXd wu = MatrixXd::Zero(m, m);  // W Lambda^-1 K_fu
  for (const Slice& b : s.slices) wu.noalias() += s.weights.middleCols(b.begin, b.size) * b.u;
  const MatrixXd wu_total = s.total.solve(wu.transpose()).transpose();
  const VectorXd w_alpha = s.weights * s.alpha;
  MatrixXd outside(m, s.alpha.size());  // W G0
  for (const Slice& b : s.slices) {
    const auto alpha = s.alpha.segment(b.begin, b.size);
    const auto w = s.weights.middleCols(b.begin, b.size);
    MatrixXd inside = -b.open.solve(MatrixXd::Identity(b.size, b.size));
    inside.noalias() += b.u * s.total.solve(b.u.transpose());
    inside.noalias() += alpha * alpha.transpose();
    inside *= 0.5;  // G_b
    auto rest = outside.middleCols(b.begin, b.size);
    rest = w_alpha * alpha.transpose() - b.open.solve(w.transpose()).transpose();
    rest.noalias() += wu_total * b.u.transpose();
    rest *= 0.5;  // W G, columns of the slice
    rest.noalias() -= w * inside;
    const Places places = survey.places.middleCols(b.begin, b.size);
    gradient.add(places, places, inside, 1.0);
    gradient.add_noise(places, inside.diagonal());
  }
  gradient.add(support, survey.places, outside, 2.0);
  const MatrixXd between = outside * s.weights.transpose();
  gradient.add(support, support, between, -1.0);
  gradient.add_variances(support, between.diagonal(), -jitter);
  gradient.add_means(survey.places, s.alpha);
}

}  // namespace

double PitcLikelihood::operator()(const Theta& theta, Theta* gradient) const {
  const GroupKernel kernel(kernel_, theta, fields_);
  const VectorXd error = kernel.errors(survey_);
  const PitcSystem s = solve(kernel, survey_, support_, slice_size_, jitter_, error);
  if (gradient) {
    Gradient sum(kernel, theta.size());
    add_pitc_gradient(s, survey_, support_, jitter_, sum);
    *gradient = sum.sum();
  }
  return log_density(error.dot(s.alpha), s.log_det, error.size());
}

}  // namespace gp_localize
