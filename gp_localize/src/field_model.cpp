#include "gp_localize/field_model.hpp"

#include "field_core/errors.hpp"
#include "gp_localize/support_set.hpp"

namespace gp_localize {
namespace {

field_core::Kernel make_kernel(const std::string& name, const FieldParams& p) {
  if (p.length_scales.size() != 2) {
    throw field_core::ParameterError("fields/" + name + "/length_scales", "must be two numbers");
  }
  return {p.kernel, p.signal_stddev, Eigen::Vector2d(p.length_scales[0], p.length_scales[1])};
}

FieldModel make_model(const std::string& name, const FieldParams& p, const Places& support,
                      const SupportParams& params) {
  const double noise_variance = p.noise_stddev * p.noise_stddev;
  try {
    return {{name, p.unit},
            p.mean,
            noise_variance,
            SupportBasis(make_kernel(name, p), support, params.jitter,
                         params.noisy ? noise_variance : 0.0, params.budget)};
  } catch (const field_core::NumericalError& error) {
    // The cause is in the configuration: a parameter error gets file and line.
    throw field_core::ParameterError("support", "field '" + name + "': " + error.what());
  }
}

}  // namespace

std::vector<FieldModel> make_field_models(const GpLocalizeParams& params) {
  std::vector<FieldModel> models;
  for (const auto& [name, p] : params.fields) {
    const auto support = select_support(params.support, make_kernel(name, p),
                                        p.noise_stddev * p.noise_stddev, params.survey);
    models.push_back(make_model(name, p, support, params.support));
  }
  return models;
}

std::vector<std::vector<FieldModel>> make_candidates(const GpLocalizeParams& params,
                                                     const std::vector<FieldModel>& fields) {
  std::vector<std::vector<FieldModel>> all;
  for (const FieldModel& field : fields) {
    std::vector<FieldModel> models;
    FieldParams scaled = params.fields.at(field.info.name);
    const FieldParams base = scaled;
    for (const double signal : params.candidates.signal) {
      for (const double noise : params.candidates.noise) {
        for (const double length : params.candidates.length_scales) {
          scaled.signal_stddev = signal * base.signal_stddev;
          scaled.noise_stddev = noise * base.noise_stddev;
          for (int axis : {0, 1}) scaled.length_scales[axis] = length * base.length_scales[axis];
          models.push_back(
              make_model(field.info.name, scaled, field.basis.support(), params.support));
        }
      }
    }
    all.push_back(std::move(models));
  }
  return all;
}

}  // namespace gp_localize
