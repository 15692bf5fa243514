#include "gp_localize/field_model.hpp"

#include <algorithm>
#include <map>

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

/// The group that a field is in, or null.
const CoregionalizationParams* group_of(const std::string& name, const GpLocalizeParams& params) {
  for (const auto& [key, group] : params.coregionalization) {
    for (const std::string& member : group.fields) {
      if (member == name) return &group;
    }
  }
  return nullptr;
}

/// With all signals multiplied by `signal`.
Coregionalization covariances(const CoregionalizationParams& group, const GpLocalizeParams& params,
                              double signal) {
  Eigen::VectorXd s(group.size());
  for (int a = 0; a < group.size(); ++a) {
    s[a] = signal * params.fields.at(group.fields[a]).signal_stddev;
  }
  return Coregionalization(s.asDiagonal() * correlation_matrix(group.size(), group.correlations) *
                           s.asDiagonal());
}

/// What a candidate multiplies the configured values by.
struct Multiples {
  double signal = 1.0, noise = 1.0, length = 1.0, survey_correlation = 1.0;
};

std::vector<Multiples> combinations(const CandidateParams& c) {
  std::vector<Multiples> all;
  for (const double correlation : c.survey_correlation) {
    for (const double signal : c.signal) {
      for (const double noise : c.noise) {
        for (const double length : c.length_scales) {
          all.push_back({signal, noise, length, correlation});
        }
      }
    }
  }
  return all;
}

SupportBasis make_basis(const std::string& name, FieldParams p, const Places& support,
                        const GpLocalizeParams& params, double signal) {
  const double noise_variance = params.support.noisy ? p.noise_stddev * p.noise_stddev : 0.0;
  const SupportParams& s = params.support;
  const CoregionalizationParams* group = group_of(name, params);
  if (!group) {
    return SupportBasis(make_kernel(name, p), support, s.jitter, noise_variance, s.budget);
  }
  p.signal_stddev = 1.0;  // the kernel's: that of the fields is among their covariances
  return SupportBasis(make_kernel(name, p), support, s.jitter, noise_variance, s.budget,
                      covariances(*group, params, signal));
}

FieldModel make_model(const std::string& name, const Places& support,
                      const GpLocalizeParams& params, const Multiples& by = {}) {
  FieldParams p = params.fields.at(name);
  p.signal_stddev *= by.signal;
  p.noise_stddev *= by.noise;
  for (double& length : p.length_scales) length *= by.length;
  try {
    return {{name, p.unit},
            p.mean,
            p.noise_stddev * p.noise_stddev,
            make_basis(name, p, support, params, by.signal),
            params.survey_correlation * by.survey_correlation};
  } catch (const field_core::NumericalError& error) {
    // The cause is in the configuration: a parameter error gets file and line.
    throw field_core::ParameterError("support", "field '" + name + "': " + error.what());
  }
}

/// Numbers the Gaussian processes and the fields in each.
void number_groups(const GpLocalizeParams& params, std::vector<FieldModel>& models) {
  std::map<const CoregionalizationParams*, int> numbers;
  int next = 0;
  for (FieldModel& model : models) {
    const CoregionalizationParams* group = group_of(model.info.name, params);
    if (!group) {
      model.group = next++;
      continue;
    }
    const auto [known, is_new] = numbers.emplace(group, next);
    if (is_new) ++next;
    model.group = known->second;
    const auto& names = group->fields;
    model.member =
        static_cast<int>(std::find(names.begin(), names.end(), model.info.name) - names.begin());
  }
}

}  // namespace

Place FieldModel::place(const Place& x) const {
  if (basis.fields() == 1) return x;
  Place at(x.size() + 1);
  at << x, member;
  return at;
}

Places FieldModel::places(const Eigen::Ref<const Places>& x) const {
  Places at;
  places(x, at);
  return at;
}

void FieldModel::places(const Eigen::Ref<const Places>& x, Places& at) const {
  at.resize(basis.place_dimensions(), x.cols());
  at.topRows(x.rows()) = x;
  if (basis.fields() > 1) at.bottomRows(1).setConstant(member);
}

std::vector<FieldModel> make_field_models(const GpLocalizeParams& params) {
  params.validate_coregionalization();
  std::vector<FieldModel> models;
  for (const auto& [name, p] : params.fields) {
    // A group has one support set; `mutual_information` chooses it for the first of its fields.
    const CoregionalizationParams* group = group_of(name, params);
    const std::string& chooser = group ? group->fields.front() : name;
    const FieldParams& c = params.fields.at(chooser);
    const auto support = select_support(params.support, make_kernel(chooser, c),
                                        c.noise_stddev * c.noise_stddev, params.survey);
    models.push_back(make_model(name, support, params));
  }
  number_groups(params, models);
  return models;
}

std::vector<int> first_fields(const std::vector<FieldModel>& fields) {
  std::vector<int> first;
  for (std::size_t f = 0; f < fields.size(); ++f) {
    if (fields[f].group == static_cast<int>(first.size())) first.push_back(static_cast<int>(f));
  }
  return first;
}

std::vector<std::vector<FieldModel>> make_candidates(const GpLocalizeParams& params,
                                                     const std::vector<FieldModel>& fields) {
  const std::vector<Multiples> choices = combinations(params.candidates);
  std::vector<std::vector<FieldModel>> all;
  for (const FieldModel& field : fields) {
    std::vector<FieldModel> models;
    for (const Multiples& by : choices) {
      models.push_back(make_model(field.info.name, field.basis.support(), params, by));
      models.back().group = field.group;
      models.back().member = field.member;
    }
    all.push_back(std::move(models));
  }
  return all;
}

}  // namespace gp_localize
