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
using field_core::Places;

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

double stddev_of(const Eigen::Ref<const Eigen::VectorXd>& v) {
  return std::sqrt((v.array() - v.mean()).square().mean());
}

/// What is learned from: fields that are one group, merged.
struct Problem {
  const FieldSurvey& survey;
  int fields;
  std::vector<double> mean, spread;  // of the values of each field

  Index dimensions() const { return survey.places.rows() - (fields > 1 ? 1 : 0); }
  GroupTheta layout() const {
    return GroupTheta(Theta::Zero(GroupTheta::size(fields, dimensions())), fields);
  }
};

Problem make_problem(const FieldSurvey& survey, int fields) {
  Problem problem{survey, fields, {}, {}};
  for (int f = 0; f < fields; ++f) {
    std::vector<double> values;
    for (Index i = 0; i < survey.values.size(); ++i) {
      if (fields == 1 || survey.places(survey.places.rows() - 1, i) == f) {
        values.push_back(survey.values[i]);
      }
    }
    const Eigen::Map<const Eigen::VectorXd> mine(values.data(), static_cast<Index>(values.size()));
    problem.mean.push_back(mine.mean());
    problem.spread.push_back(stddev_of(mine));
  }
  return problem;
}

Box search_box(const Problem& p) {
  const auto places = p.survey.places.topRows(p.dimensions());
  const double extent = (places.rowwise().maxCoeff() - places.rowwise().minCoeff()).maxCoeff();
  const GroupTheta at = p.layout();
  const Index size = GroupTheta::size(p.fields, p.dimensions());
  Box box{Theta(size), Theta(size)};
  const auto set = [&box](Index i, double low, double high) {
    box.low[i] = low;
    box.high[i] = high;
  };
  constexpr double kMost = 0.999;  // partial correlation
  for (int f = 0; f < p.fields; ++f) {
    set(at.mean_at(f), p.mean[f] - 10.0 * p.spread[f], p.mean[f] + 10.0 * p.spread[f]);
    set(at.signal_at(f), std::log(0.05 * p.spread[f]), std::log(20.0 * p.spread[f]));
    set(at.noise_at(f), std::log(1e-3 * p.spread[f]), std::log(3.0 * p.spread[f]));
    for (int g = 0; g < f; ++g) set(at.partial_at(f, g), -kMost, kMost);
  }
  for (Index i = at.lengths_at(); i < size; ++i)
    set(i, std::log(extent / 200.0), std::log(10.0 * extent));
  return box;
}

Theta random_start(const Problem& p, const Box& box, field_core::Random& random) {
  const GroupTheta at = p.layout();
  Theta theta(box.low.size());
  for (int f = 0; f < p.fields; ++f) {
    theta[at.mean_at(f)] = p.mean[f];
    theta[at.signal_at(f)] = std::log(p.spread[f] * random.uniform(0.7, 1.5));
    theta[at.noise_at(f)] = std::log(p.spread[f] * random.uniform(0.03, 0.6));
    for (int g = 0; g < f; ++g) theta[at.partial_at(f, g)] = random.uniform(-0.5, 0.5);
  }
  // Between 1/40 of the extent and the extent.
  for (Index i = at.lengths_at(); i < theta.size(); ++i)
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

/// Places, each with every field of the group.
Places with_fields(const Places& places, int fields) {
  if (fields == 1) return places;
  Places all(places.rows() + 1, fields * places.cols());
  for (Index i = 0; i < all.cols(); ++i) {
    all.col(i) << places.col(i / fields), static_cast<double>(i % fields);
  }
  return all;
}

std::unique_ptr<MarginalLikelihood> make_likelihood(field_core::KernelType kernel, const Problem& p,
                                                    const LearningOptions& options) {
  if (p.survey.values.size() <= options.exact_up_to) {
    return std::make_unique<FullLikelihood>(kernel, p.survey, p.fields);
  }
  const Places places = p.survey.places.topRows(p.dimensions());
  const Places support = spread_over(places, places.rowwise().mean(), options.support);
  constexpr double kJitter = 1e-6;
  return std::make_unique<PitcLikelihood>(kernel, p.survey, with_fields(support, p.fields),
                                          options.slice_size * p.fields, kJitter, p.fields);
}

/// Where the likelihood is highest.
struct Maximum {
  field_core::KernelType kernel;
  Theta theta;
  Eigen::MatrixXd covariance;  // of theta; NaN for what is not determined
  double log_likelihood = -std::numeric_limits<double>::infinity();
  int starts, agreeing;
};

/// By the Hessian (differences of the analytic gradient) of what is not at a bound.
Eigen::MatrixXd covariance_at(const MarginalLikelihood& likelihood, const Theta& best,
                              const Box& box, const Problem& p) {
  constexpr double kStep = 1e-3;
  std::vector<Index> free;
  for (Index i = 0; i < best.size(); ++i) {
    if (!box.at_bound(best, i)) free.push_back(i);
  }
  const auto n = static_cast<Index>(free.size());
  Eigen::MatrixXd information(n, n);
  for (Index a = 0; a < n; ++a) {
    const double step = free[a] < p.fields ? kStep * p.spread[free[a]] : kStep;
    Theta above = best, below = best, up, down;
    above[free[a]] += step;
    below[free[a]] -= step;
    likelihood(above, &up);
    likelihood(below, &down);
    for (Index b = 0; b < n; ++b) information(a, b) = (down - up)[free[b]] / (2.0 * step);
  }
  information = 0.5 * (information + information.transpose()).eval();
  Eigen::MatrixXd all =
      Eigen::MatrixXd::Constant(best.size(), best.size(), std::numeric_limits<double>::quiet_NaN());
  const Eigen::LLT<Eigen::MatrixXd> factor(information);
  if (factor.info() != Eigen::Success) return all;
  const Eigen::MatrixXd covariance = factor.solve(Eigen::MatrixXd::Identity(n, n));
  for (Index a = 0; a < n; ++a) {
    for (Index b = 0; b < n; ++b) all(free[a], free[b]) = covariance(a, b);
  }
  return all;
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

/// One search from `at`; the log likelihood it ends with, -infinity if nowhere.
double climb(const MarginalLikelihood& likelihood, const Box& box, Theta& at) {
  ceres::GradientProblem problem(new NegativeLikelihood(likelihood, box));
  ceres::GradientProblemSolver::Options solver;
  solver.logging_type = ceres::SILENT;
  solver.max_num_iterations = 200;
  solver.function_tolerance = 1e-10;
  ceres::GradientProblemSolver::Summary summary;
  ceres::Solve(solver, problem, at.data(), &summary);
  return summary.IsSolutionUsable() ? -summary.final_cost : -INFINITY;
}

Maximum maximize(const Problem& p, const LearningOptions& options,
                 const LearningProgress& progress) {
  const Box box = search_box(p);
  std::vector<double> maxima;
  std::unique_ptr<MarginalLikelihood> best_likelihood;
  Maximum best;
  best.starts = options.starts * static_cast<int>(options.kernels.size());
  for (const auto kernel : options.kernels) {
    field_core::Random random(options.seed);
    for (int start = 0; start < options.starts; ++start) {
      if (progress) progress(static_cast<int>(maxima.size()) + 1, best.starts, best.log_likelihood);
      auto likelihood = make_likelihood(kernel, p, options);
      Theta at = box.outside(random_start(p, box, random));
      const double found = climb(*likelihood, box, at);
      maxima.push_back(found);
      if (found <= best.log_likelihood) continue;
      best.log_likelihood = found;
      best.kernel = kernel;
      best.theta = box.inside(at);
      best_likelihood = std::move(likelihood);
    }
  }
  if (!best_likelihood) {
    throw field_core::NumericalError(
        "the likelihood has no maximum from any start; are the places of the measurements right?");
  }
  best.covariance = covariance_at(*best_likelihood, best.theta, box, p);
  best.agreeing =
      static_cast<int>(std::count_if(maxima.begin(), maxima.end(), [&best](double maximum) {
        return maximum > best.log_likelihood - 0.1;
      }));
  return best;
}

LearnedField field_of(const Maximum& m, const Problem& p, int f, const LearningOptions& options) {
  const GroupTheta at(m.theta, p.fields);
  const auto error = [&m](Index i) { return std::sqrt(m.covariance(i, i)); };
  LearnedField learned{};
  learned.kernel = m.kernel;
  learned.value = {at.mean(f), at.signal_stddev(f), at.noise_stddev(f), at.length_scales()};
  field_core::Place lengths = at.length_scales();
  for (Index i = 0; i < lengths.size(); ++i) lengths[i] *= error(at.lengths_at() + i);
  learned.standard_error = {error(at.mean_at(f)), at.signal_stddev(f) * error(at.signal_at(f)),
                            at.noise_stddev(f) * error(at.noise_at(f)), lengths};
  learned.log_likelihood = m.log_likelihood;
  learned.measurements = static_cast<int>(p.survey.values.size());
  learned.exact = learned.measurements <= options.exact_up_to;
  learned.starts = m.starts;
  learned.agreeing = m.agreeing;
  return learned;
}

/// Standard errors of the correlations from those of the partial ones, to first order.
Eigen::MatrixXd correlation_errors(const Maximum& m, int fields) {
  constexpr double kStep = 1e-5;
  const GroupTheta at(m.theta, fields);
  const Index first = at.partial_at(1, 0), count = at.lengths_at() - first;
  const auto correlations = [&](Index i, double step) {
    Theta beside = m.theta;
    beside[first + i] += step;
    return GroupTheta(beside, fields).correlation();
  };
  std::vector<Eigen::MatrixXd> slopes;
  for (Index i = 0; i < count; ++i) {
    slopes.push_back((correlations(i, kStep) - correlations(i, -kStep)) / (2.0 * kStep));
  }
  Eigen::MatrixXd variance = Eigen::MatrixXd::Zero(fields, fields);
  for (Index i = 0; i < count; ++i) {
    for (Index j = 0; j < count; ++j) {
      const Eigen::MatrixXd both = slopes[i].cwiseProduct(slopes[j]);
      for (Index k = 0; k < both.size(); ++k) {  // 0 times NaN: it does not depend on that one
        if (both.data()[k] != 0.0) {
          variance.data()[k] += both.data()[k] * m.covariance(first + i, first + j);
        }
      }
    }
  }
  return variance.cwiseSqrt();
}

}  // namespace

LearnedField learn_hyperparameters(const FieldSurvey& survey, const LearningOptions& options,
                                   const LearningProgress& progress) {
  require_enough(survey);
  const Problem problem = make_problem(survey, 1);
  return field_of(maximize(problem, options, progress), problem, 0, options);
}

LearnedGroup learn_group(const Survey& survey, const std::vector<std::string>& names,
                         const LearningOptions& options, const LearningProgress& progress) {
  for (const std::string& name : names) {
    const auto field = survey.find(name);
    try {
      if (field == survey.end()) throw field_core::DataError("was not measured; leave it out");
      require_enough(field->second);
    } catch (const field_core::DataError& error) {
      throw field_core::DataError("field '" + name + "' " + error.what());
    }
  }
  const int fields = static_cast<int>(names.size());
  const FieldSurvey all = merge(survey, names);
  const Problem problem = make_problem(all, fields);
  const Maximum maximum = maximize(problem, options, progress);
  LearnedGroup group{names,
                     {},
                     GroupTheta(maximum.theta, fields).correlation(),
                     correlation_errors(maximum, fields)};
  for (int f = 0; f < fields; ++f) {
    group.fields.push_back(field_of(maximum, problem, f, options));
    group.fields.back().measurements = static_cast<int>(survey.at(names[f]).values.size());
  }
  return group;
}

}  // namespace gp_localize
