#include "survey_map.hpp"

namespace gp_localize {
namespace {

/// @param fields those of one group, by number in it
SupportPosterior posterior(const std::vector<const FieldModel*>& fields, const Survey& survey) {
  constexpr int kSlice = 50;
  const SupportBasis& basis = fields.front()->basis;
  const int m = static_cast<int>(basis.size());
  std::vector<std::string> names;
  for (const FieldModel* field : fields) names.push_back(field->info.name);
  const FieldSurvey all = merge(survey, names);
  SupportPosterior closed(m);
  OpenSlice slice(m, kSlice * static_cast<int>(fields.size()), basis.place_dimensions());
  Evaluation at;
  Features features;
  for (Eigen::Index i = 0; i < all.values.size(); ++i) {
    const FieldModel& field = *fields[static_cast<int>(all.places(2, i))];
    const Place place = field.place(all.places.col(i).head<2>());
    basis.features(place, features);
    slice.evaluate(basis, closed, place, features.data(), Recent::used, at);
    slice.append(place, features.data(), at, all.values[i] - field.mean, field.noise_variance);
    if (slice.full()) slice.close(closed, closed);
  }
  slice.close(closed, closed);
  return closed;
}

/// The survey's field is only correlated with the robot's: u = rho u_survey + sqrt(1 - rho^2) v.
void weaken(double rho, SupportPosterior& posterior) {
  const int m = posterior.support_size();
  double* number = posterior.numbers();
  for (int column = 0; column < m; ++column) {
    for (int row = column; row < m; ++row, ++number) {
      *number = rho * rho * *number + (row == column ? 1.0 - rho * rho : 0.0);
    }
  }
  for (int row = 0; row < m; ++row) *number++ *= rho;
}

}  // namespace

std::vector<SupportPosterior> map_from_survey(const std::string& path,
                                              const std::vector<FieldModel>& fields) {
  std::vector<std::string> names;
  for (const FieldModel& field : fields) names.push_back(field.info.name);
  const Survey survey = read_survey(path, names);
  std::vector<SupportPosterior> map;
  for (const int first : first_fields(fields)) {
    std::vector<const FieldModel*> group(fields[first].basis.fields());
    for (const FieldModel& field : fields) {
      if (field.group == fields[first].group) group[field.member] = &field;
    }
    map.push_back(posterior(group, survey));
    weaken(fields[first].survey_correlation, map.back());
  }
  return map;
}

}  // namespace gp_localize
