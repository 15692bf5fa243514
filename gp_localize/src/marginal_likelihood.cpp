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

enum { kMean, kSignal, kNoise, kLengths };

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

/// gradient += factor <weights, d K / d theta> for K between the columns of a and b.
void add_kernel_gradient(const Kernel& kernel, const Places& a, const Places& b,
                         const MatrixXd& weights, double factor, Theta& gradient) {
  double signal = 0.0;
  Place lengths = Place::Zero(kernel.dimensions());
  for (Index j = 0; j < b.cols(); ++j) {
    for (Index i = 0; i < a.cols(); ++i) {
      const Place square = (a.col(i) - b.col(j)).cwiseQuotient(kernel.length_scales()).cwiseAbs2();
      const double r2 = square.sum();
      signal += weights(i, j) * field_core::correlation(kernel.type(), r2);
      lengths += weights(i, j) * field_core::correlation_slope(kernel.type(), r2) * square;
    }
  }
  const double scale = factor * kernel.signal_variance();
  gradient[kSignal] += 2.0 * scale * signal;
  gradient.tail(lengths.size()) -= 2.0 * scale * lengths;
}

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
  return {t[kMean], std::exp(t[kSignal]), std::exp(t[kNoise]),
          t.tail(t.size() - kLengths).unaryExpr([](double log) { return std::exp(log); })};
}

double FullLikelihood::operator()(const Theta& theta, Theta* gradient) const {
  const Hyperparameters h = from_theta(theta);
  const Kernel kernel(kernel_, h.signal_stddev, h.length_scales);
  const Index n = survey_.values.size();
  MatrixXd sigma = kernel.matrix(survey_.places, survey_.places);
  sigma.diagonal().array() += h.noise_stddev * h.noise_stddev;
  const auto factor = factorize(sigma, "the covariance of the measurements");
  const VectorXd error = survey_.values.array() - h.mean;
  const VectorXd alpha = factor.solve(error);
  if (gradient) {
    gradient->setZero(theta.size());
    MatrixXd g = -0.5 * factor.solve(MatrixXd::Identity(n, n));
    g.noalias() += 0.5 * alpha * alpha.transpose();
    add_kernel_gradient(kernel, survey_.places, survey_.places, g, 1.0, *gradient);
    (*gradient)[kNoise] = 2.0 * h.noise_stddev * h.noise_stddev * g.trace();
    (*gradient)[kMean] = alpha.sum();
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

PitcSystem solve(const Kernel& kernel, const FieldSurvey& survey, const Places& support,
                 int slice_size, double jitter, double noise_variance, const VectorXd& error) {
  PitcSystem s;
  MatrixXd b = kernel.matrix(support, support);
  b.diagonal().array() += jitter * kernel.signal_variance();
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
    lambda.diagonal().array() += noise_variance;
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

void add_pitc_gradient(const PitcSystem& s, const Kernel& kernel, const FieldSurvey& survey,
                       const Places& support, double jitter, double noise_variance,
                       Theta& gradient) {
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
    add_kernel_gradient(kernel, places, places, inside, 1.0, gradient);
    gradient[kNoise] += 2.0 * noise_variance * inside.trace();
  }
  add_kernel_gradient(kernel, support, survey.places, outside, 2.0, gradient);
  const MatrixXd between = outside * s.weights.transpose();
  add_kernel_gradient(kernel, support, support, between, -1.0, gradient);
  gradient[kSignal] -= 2.0 * jitter * kernel.signal_variance() * between.trace();
  gradient[kMean] += s.alpha.sum();
}

}  // namespace

double PitcLikelihood::operator()(const Theta& theta, Theta* gradient) const {
  const Hyperparameters h = from_theta(theta);
  const Kernel kernel(kernel_, h.signal_stddev, h.length_scales);
  const VectorXd error = survey_.values.array() - h.mean;
  const double noise_variance = h.noise_stddev * h.noise_stddev;
  const PitcSystem s =
      solve(kernel, survey_, support_, slice_size_, jitter_, noise_variance, error);
  if (gradient) {
    gradient->setZero(theta.size());
    add_pitc_gradient(s, kernel, survey_, support_, jitter_, noise_variance, *gradient);
  }
  return log_density(error.dot(s.alpha), s.log_det, error.size());
}

}  // namespace gp_localize
