#include <cmath>
#include <cstdio>

#include "gp_localize/hyperparameter_learning.hpp"

namespace gp_localize {
namespace {

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%#.5g", value);  // always with a point: YAML 1.1's numbers
  return text;
}

std::string error(double value) {
  return std::isfinite(value) ? "+- " + number(value) : "not determined by the measurements";
}

const char* kernel_name(field_core::KernelType kernel) {
  switch (kernel) {
    case field_core::KernelType::matern32:
      return "matern32";
    case field_core::KernelType::matern52:
      return "matern52";
    case field_core::KernelType::squared_exponential:
      break;
  }
  return "squared_exponential";
}

}  // namespace

std::string to_yaml(const std::string& name, const std::string& unit, const LearnedField& f) {
  const std::string in = "    ";
  std::string text = "  " + name + ":\n";
  text += in + "# " + std::to_string(f.measurements) + " measurements, " +
          (f.exact ? "full GP" : "PITC") + ", log likelihood " + number(f.log_likelihood) + "; " +
          std::to_string(f.agreeing) + " of " + std::to_string(f.starts) + " starts agree\n";
  text += in + "unit: \"" + unit + "\"\n";
  text += in + "kernel: " + kernel_name(f.kernel) + "\n";
  const Hyperparameters &v = f.value, &e = f.standard_error;
  text += in + "mean: " + number(v.mean) + "  # " + error(e.mean) + "\n";
  text += in + "signal_stddev: " + number(v.signal_stddev) + "  # " + error(e.signal_stddev) + "\n";
  text += in + "noise_stddev: " + number(v.noise_stddev) + "  # " + error(e.noise_stddev) + "\n";
  text += in + "length_scales: [" + number(v.length_scales.x()) + ", " +
          number(v.length_scales.y()) + "]  # " + error(e.length_scales.x()) + ", " +
          error(e.length_scales.y()) + "\n";
  return text;
}

std::string to_yaml(const std::string& name, const LearnedGroup& group) {
  std::string names, correlations, errors;
  const auto fields = static_cast<Eigen::Index>(group.names.size());
  for (Eigen::Index a = 0; a < fields; ++a) {
    names += (a ? ", " : "") + group.names[a];
    for (Eigen::Index b = a + 1; b < fields; ++b) {
      const std::string comma = correlations.empty() ? "" : ", ";
      correlations += comma + number(group.correlation(a, b));
      errors += comma + error(group.correlation_error(a, b));
    }
  }
  return "  " + name +
         ":\n    # learned together: the log likelihood of these fields is that of all\n" +
         "    fields: [" + names + "]\n    correlations: [" + correlations + "]  # " + errors +
         "\n";
}

}  // namespace gp_localize
