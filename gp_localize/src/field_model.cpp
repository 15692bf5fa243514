#include "gp_localize/field_model.hpp"

#include "field_core/errors.hpp"
#include "gp_localize/support_set.hpp"

namespace gp_localize {
namespace {

field_core::Kernel make_kernel(const std::string& name, const FieldParams& p) {
  if (p.length_scales.size() != 2) {
    throw field_core::ParameterError("fields/" + name + "/length_scales", "must be two numbers");
  }
  return field_core::Kernel(p.kernel, p.signal_stddev, {p.length_scales[0], p.length_scales[1]});
}

}  // namespace

std::vector<FieldModel> make_field_models(const GpLocalizeParams& params) {
  std::vector<FieldModel> models;
  for (const auto& [name, p] : params.fields) {
    const double noise_variance = p.noise_stddev * p.noise_stddev;
    try {
      const field_core::Kernel kernel = make_kernel(name, p);
      models.push_back(
          {{name, p.unit},
           p.mean,
           noise_variance,
           SupportBasis(kernel,
                        select_support(params.support, kernel, noise_variance, params.survey),
                        params.support.jitter, params.support.noisy ? noise_variance : 0.0)});
    } catch (const field_core::NumericalError& error) {
      // The cause is in the configuration: a parameter error gets file and line.
      throw field_core::ParameterError("support", "field '" + name + "': " + error.what());
    }
  }
  return models;
}

}  // namespace gp_localize
