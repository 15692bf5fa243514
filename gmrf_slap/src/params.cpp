#include "gmrf_slap/params.hpp"

#include <cmath>
#include <set>

#include "field_core/errors.hpp"

namespace gmrf_slap {

using field_core::ParameterError;

void GridParams::validate() const {
  for (const double n : size) {
    if (n != std::floor(n)) throw ParameterError("size", "must be two whole numbers of sites");
  }
}

void HyperparameterParams::validate() const {
  const bool paper = kappa > 0.0 && alpha > 0.0, metric = bandwidth > 0.0 && stddev > 0.0;
  const bool some_paper = kappa > 0.0 || alpha > 0.0, some_metric = bandwidth > 0.0 || stddev > 0.0;
  if ((paper && !some_metric) || (metric && !some_paper)) return;
  throw ParameterError(some_metric ? "bandwidth" : "kappa",
                       "give either kappa and alpha, or bandwidth and stddev, all > 0");
}

void FieldParams::validate() const {}

void GmrfSlapParams::validate() const {
  for (const auto& [name, field] : fields) {
    if (field.hyperparameters.empty() && hyperparameters.empty()) {
      throw ParameterError("fields/" + name + "/hyperparameters",
                           "is empty, and so are the common hyperparameters; give "
                           "[{bandwidth: ..., stddev: ...}]");
    }
  }
  if (robots.empty()) throw ParameterError("robots", "is empty; name at least one robot");
  if (std::set<std::string>(robots.begin(), robots.end()).size() != robots.size()) {
    throw ParameterError("robots", "names a robot twice; every robot needs a name of its own");
  }
}

}  // namespace gmrf_slap
