#include "evaluation.hpp"

#include <stdexcept>

#include "field_core/errors.hpp"
#include "trajectory_source.hpp"

namespace field_eval {
namespace {

using field_core::DataError;
using field_core::NumericalError;
using field_core::Trajectory;

const char* name_of(field_core::Alignment alignment) {
  switch (alignment) {
    case field_core::Alignment::first:
      return "first";
    case field_core::Alignment::best:
      return "best";
    default:
      return "none";
  }
}

Row baseline_row(const Baseline& baseline, const Trajectory& truth, const Trajectory& estimate) {
  Row row{baseline.name, baseline.source, std::nullopt, {}, {}};
  const Trajectory all = load(baseline.source);
  row.trajectory = field_core::between_stamps(all, estimate.front().stamp, estimate.back().stamp);
  if (row.trajectory.empty()) {
    throw DataError("no stamp lies within the estimate's; both must be stamped by the same clock");
  }
  if (baseline.kind == BaselineKind::scaled) {
    row.translation_scale = field_core::best_translation_scale(truth, row.trajectory);
  }
  if (baseline.kind != BaselineKind::as_is) {
    row.trajectory = field_core::dead_reckoning_from_truth(truth, row.trajectory,
                                                           row.translation_scale.value_or(1.0));
  }
  return row;
}

// Says which trajectory an error is about, unless its text already does.
template <class Function>
auto about(const std::string& name, const std::string& source, Function function) {
  const auto text = [&](const std::exception& error) {
    const std::string what = error.what();
    return what.find(source) != std::string::npos ? what : name + " (" + source + "): " + what;
  };
  try {
    return function();
  } catch (const DataError& error) {
    throw DataError(text(error));
  } catch (const NumericalError& error) {
    throw NumericalError(text(error));
  }
}

}  // namespace

Baseline parse_baseline(const std::string& text) {
  const auto equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
    throw std::invalid_argument("'" + text +
                                "' is no baseline; write NAME=FILE, NAME=odom:FILE or "
                                "NAME=scaled:FILE");
  }
  Baseline baseline{text.substr(0, equals), text.substr(equals + 1), BaselineKind::as_is};
  if (baseline.source.rfind("odom:", 0) == 0) {
    baseline.kind = BaselineKind::odometry;
    baseline.source.erase(0, 5);
  } else if (baseline.source.rfind("scaled:", 0) == 0) {
    baseline.kind = BaselineKind::scaled;
    baseline.source.erase(0, 7);
  }
  const std::string problem = problem_of_source(baseline.source);
  if (!problem.empty()) throw std::invalid_argument(problem);
  return baseline;
}

Evaluation evaluate(const Options& options) {
  const Trajectory truth = load(options.truth);
  Evaluation evaluation;
  evaluation.truth_source = options.truth;
  evaluation.alignment = name_of(options.alignment);
  Row estimate{"estimate", options.estimate, std::nullopt, load(options.estimate), {}};
  const Trajectory span = estimate.trajectory;
  evaluation.rows.push_back(std::move(estimate));
  for (const auto& baseline : options.baselines) {
    evaluation.rows.push_back(
        about(baseline.name, baseline.source, [&] { return baseline_row(baseline, truth, span); }));
  }
  for (auto& row : evaluation.rows) {
    row.errors = about(row.name, row.source, [&] {
      return field_core::compare(truth, row.trajectory, options.alignment,
                                 options.relative_distance);
    });
  }
  evaluation.truth = field_core::between_stamps(truth, span.front().stamp, span.back().stamp);
  const auto& stamps = evaluation.rows.front().errors.stamps;
  evaluation.duration_s = field_core::to_seconds(stamps.back() - stamps.front());
  for (std::size_t i = 1; i < evaluation.truth.size(); ++i) {
    evaluation.driven_m +=
        (evaluation.truth[i].pose.translation() - evaluation.truth[i - 1].pose.translation())
            .norm();
  }
  return evaluation;
}

}  // namespace field_eval
