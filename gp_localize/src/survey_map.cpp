#include "survey_map.hpp"

namespace gp_localize {
namespace {

SupportPosterior posterior(const FieldModel& field, const FieldSurvey& survey) {
  constexpr int kSlice = 50;
  const int m = static_cast<int>(field.basis.size());
  SupportPosterior closed(m);
  OpenSlice slice(m, kSlice);
  Evaluation at;
  Features features;
  for (Eigen::Index i = 0; i < survey.values.size(); ++i) {
    const Eigen::Vector2d place = survey.places.col(i);
    field.basis.features(place, features);
    slice.evaluate(field.basis, closed, place, features.data(), Recent::used, at);
    slice.append(place, features.data(), at, survey.values[i] - field.mean, field.noise_variance);
    if (slice.full()) slice.close(closed, closed);
  }
  slice.close(closed, closed);
  return closed;
}

}  // namespace

std::vector<SupportPosterior> map_from_survey(const std::string& path,
                                              const std::vector<FieldModel>& fields) {
  std::vector<std::string> names;
  for (const FieldModel& field : fields) names.push_back(field.info.name);
  const Survey survey = read_survey(path, names);
  std::vector<SupportPosterior> map;
  for (const FieldModel& field : fields)
    map.push_back(posterior(field, survey.at(field.info.name)));
  return map;
}

}  // namespace gp_localize
