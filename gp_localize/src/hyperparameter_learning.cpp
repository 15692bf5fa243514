#include "gp_localize/hyperparameter_learning.hpp"

#include <ceres/gradient_problem.h>
#include <ceres/gradient_problem_solver.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "field_core/errors.hpp"
#include "field_core/random.hpp"
#include "gp_localize/support_set.hpp"

namespace gp_localize {
namespace {

using Eigen::Index;

/// Coordinates without bounds for theta within its box: theta = low + (high - low) / (1 + exp(-t)).
struct Box {
  Theta low, high;

  Theta inside(const Theta& t) const {
    return low.array() + (high - low).array() / (1.0 + (-t.array()).exp());
  }
  Theta outside(const Theta& theta) const {
    const auto share = (theta - low).array() / (high - low).array();
    return (share / (1.0 - share)).log();
  }
  Theta slope(const Theta& t) const {
    const auto share = 1.0 / (1.0 + (-t.array()).exp());
    return (high - low).array() * share * (1.0 - share);
  }
  bool at_bound(const Theta& theta, Index i) const {
    const double margin = 0.01 * (high[i] - low[i]);
    return theta[i] < low[i] + margin || theta[i] > high[i] - margin;
  }
};

double stddev_of(const Eigen::VectorXd& v) {
  return std::sqrt((v.array() - v.mean()).square().mean());
}

/// theta begins with mean, signal and noise; the length scales follow.
constexpr Index kFirstLength = 3;

Box search_box(const FieldSurvey& s) {
  const double extent = (s.places.rowwise().maxCoeff() - s.places.rowwise().minCoeff()).maxCoeff();
  const double spread = stddev_of(s.values);
  const Index size = kFirstLength + s.places.rows();
  Box box{Theta(size), Theta(size)};
  const auto set = [&box](Index i, double low, double high) {
    box.low[i] = low;
    box.high[i] = high;
  };
  set(0, s.values.mean() - 10.0 * spread, s.values.mean() + 10.0 * spread);
  set(1, std::log(0.05 * spread), std::log(20.0 * spread));
  set(2, std::log(1e-3 * spread), std::log(3.0 * spread));
  for (Index i = kFirstLength; i < size; ++i)
    set(i, std::log(extent / 200.0), std::log(10.0 * extent));
  return box;
}

Theta random_start(const FieldSurvey& s, const Box& box, field_core::Random& random) {
  const double spread = stddev_of(s.values);
  Theta theta(box.low.size());
  theta[0] = s.values.mean();
  theta[1] = std::log(spread * random.uniform(0.7, 1.5));
  theta[2] = std::log(spread * random.uniform(0.03, 0.6));
  // Between 1/40 of the extent and the extent.
  for (Index i = kFirstLength; i < theta.size(); ++i)
    theta[i] = box.high[i] - std::log(10.0) - random.uniform(0.0, std::log(40.0));
  return theta;
}

class NegativeLikelihood final : public ceres::FirstOrderFunction {
 public:
  NegativeLikelihood(const MarginalLikelihood& likelihood, const Box& box)
      : likelihood_(likelihood), box_(box) {}
  int NumParameters() const override { return static_cast<int>(box_.low.size()); }
  bool Evaluate(const double* t, double* cost, double* gradient) const override {
    const Eigen::Map<const Eigen::VectorXd> at(t, box_.low.size());
    Theta slope;
    try {
      cost[0] = -likelihood_(box_.inside(at), gradient ? &slope : nullptr);
    } catch (const field_core::NumericalError&) {
      return false;  // too far: the line search takes a shorter step
    }
    if (gradient) {
      Eigen::Map<Eigen::VectorXd> out(gradient, box_.low.size());
      out = -slope.cwiseProduct(box_.slope(at));
    }
    return std::isfinite(cost[0]);
  }

 private:
  const MarginalLikelihood& likelihood_;
  const Box& box_;
};

std::unique_ptr<MarginalLikelihood> make_likelihood(field_core::KernelType kernel,
                                                    const FieldSurvey& survey,
                                                    const LearningOptions& options) {
  if (survey.values.size() <= options.exact_up_to) {
    return std::make_unique<FullLikelihood>(kernel, survey);
  }
  return std::make_unique<PitcLikelihood>(
      kernel, survey, spread_over(survey.places, survey.places.rowwise().mean(), options.support),
      options.slice_size);
}

/// Standard errors by the Hessian (differences of the analytic gradient) of what is not at a bound.
Hyperparameters standard_errors(const MarginalLikelihood& likelihood, const Theta& best,
                                const Box& box, double spread) {
  constexpr double kStep = 1e-3;
  std::vector<Index> free;
  for (Index i = 0; i < best.size(); ++i) {
    if (!box.at_bound(best, i)) free.push_back(i);
  }
  const auto n = static_cast<Index>(free.size());
  Eigen::MatrixXd information(n, n);
  for (Index a = 0; a < n; ++a) {
    const double step = free[a] == 0 ? kStep * spread : kStep;
    Theta above = best, below = best, up, down;
    above[free[a]] += step;
    below[free[a]] -= step;
    likelihood(above, &up);
    likelihood(below, &down);
    for (Index b = 0; b < n; ++b) information(a, b) = (down - up)[free[b]] / (2.0 * step);
  }
  information = 0.5 * (information + information.transpose()).eval();
  Theta error = Theta::Constant(best.size(), std::numeric_limits<double>::quiet_NaN());
  const Eigen::LLT<Eigen::MatrixXd> factor(information);
  if (factor.info() == Eigen::Success) {
    const Eigen::MatrixXd covariance = factor.solve(Eigen::MatrixXd::Identity(n, n));
    for (Index a = 0; a < n; ++a) error[free[a]] = std::sqrt(covariance(a, a));
  }
  const Hyperparameters h = from_theta(best);
  return {error[0], h.signal_stddev * error[1], h.noise_stddev * error[2],
          h.length_scales.cwiseProduct(error.tail(h.length_scales.size()))};
}

void require_enough(const FieldSurvey& s) {
  if (s.values.size() < 10) {
    throw field_core::DataError("has " + std::to_string(s.values.size()) +
                                " measurements; at least 10 are needed");
  }
  if (stddev_of(s.values) <= 1e-12 * s.values.cwiseAbs().maxCoeff()) {
    throw field_core::DataError("has the same value everywhere; leave the field out");
  }
  if ((s.places.colwise() - s.places.col(0)).cwiseAbs().maxCoeff() <= 0.0) {
    throw field_core::DataError("was measured at a single place; measure at more places");
  }
}

}  // namespace

LearnedField learn_hyperparameters(const FieldSurvey& survey, const LearningOptions& options,
                                   const LearningProgress& progress) {
  require_enough(survey);
  const Box box = search_box(survey);
  const int starts = options.starts * static_cast<int>(options.kernels.size());
  std::vector<double> maxima;
  Theta best_theta;
  std::unique_ptr<MarginalLikelihood> best_likelihood;
  LearnedField learned{};
  learned.log_likelihood = -std::numeric_limits<double>::infinity();
  for (const auto kernel : options.kernels) {
    field_core::Random random(options.seed);
    for (int start = 0; start < options.starts; ++start) {
      if (progress) progress(static_cast<int>(maxima.size()) + 1, starts, learned.log_likelihood);
      auto likelihood = make_likelihood(kernel, survey, options);
      Theta at = box.outside(random_start(survey, box, random));
      ceres::GradientProblem problem(new NegativeLikelihood(*likelihood, box));
      ceres::GradientProblemSolver::Options solver;
      solver.logging_type = ceres::SILENT;
      solver.max_num_iterations = 200;
      solver.function_tolerance = 1e-10;
      ceres::GradientProblemSolver::Summary summary;
      ceres::Solve(solver, problem, at.data(), &summary);
      const double found = summary.IsSolutionUsable() ? -summary.final_cost : -INFINITY;
      maxima.push_back(found);
      if (found <= learned.log_likelihood) continue;
      learned.log_likelihood = found;
      learned.kernel = kernel;
      best_theta = box.inside(at);
      best_likelihood = std::move(likelihood);
    }
  }
  if (!best_likelihood) {
    throw field_core::NumericalError(
        "the likelihood has no maximum from any start; are the places of the measurements right?");
  }
  learned.value = from_theta(best_theta);
  learned.standard_error =
      standard_errors(*best_likelihood, best_theta, box, stddev_of(survey.values));
  learned.measurements = static_cast<int>(survey.values.size());
  learned.exact = learned.measurements <= options.exact_up_to;
  learned.starts = starts;
  learned.agreeing =
      static_cast<int>(std::count_if(maxima.begin(), maxima.end(), [&learned](double maximum) {
        return maximum > learned.log_likelihood - 0.1;
      }));
  return learned;
}

}  // namespace gp_localize
