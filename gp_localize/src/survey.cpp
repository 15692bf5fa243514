#include "gp_localize/survey.hpp"

#include <algorithm>

#include "field_core/csv.hpp"
#include "field_core/errors.hpp"

namespace gp_localize {
namespace {

std::vector<std::string> field_columns(const field_core::CsvTable& table) {
  std::vector<std::string> names;
  for (const std::string& name : table.columns()) {
    if (name != "x_m" && name != "y_m" && name != "stamp_s" && name != "yaw_rad") {
      names.push_back(name);
    }
  }
  if (names.empty()) {
    throw field_core::DataError(table.path() +
                                ": has no column beside x_m and y_m; add one per field");
  }
  return names;
}

}  // namespace

void SurveyBuilder::add(const std::string& field, const Eigen::Vector2d& place, double value) {
  rows_[field].emplace_back(place.x(), place.y(), value);
  order_[field].push_back(count_++);
}

Survey SurveyBuilder::build() const {
  Survey survey;
  for (const auto& [name, rows] : rows_) {
    FieldSurvey& field = survey[name];
    const auto count = static_cast<Eigen::Index>(rows.size());
    field.places.resize(2, count);
    field.values.resize(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      field.places.col(i) = rows[i].head<2>();
      field.values[i] = rows[i].z();
    }
    field.order = order_.at(name);
  }
  return survey;
}

Survey read_survey(const std::string& path, const std::vector<std::string>& fields) {
  const auto table = field_core::CsvTable::read(path);
  const std::size_t x = table.column("x_m"), y = table.column("y_m");
  const std::vector<std::string> names = fields.empty() ? field_columns(table) : fields;
  std::vector<std::size_t> columns;
  for (const std::string& name : names) columns.push_back(table.column(name));
  SurveyBuilder builder;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    for (std::size_t f = 0; f < names.size(); ++f) {
      if (table.empty(row, columns[f])) continue;
      builder.add(names[f], {table.number(row, x), table.number(row, y)},
                  table.number(row, columns[f]));
    }
  }
  Survey survey = builder.build();
  for (const std::string& name : names) {
    if (survey.count(name) > 0) continue;
    throw field_core::DataError(path + ": column '" + name +
                                "' has no measurement; leave the field out");
  }
  return survey;
}

FieldSurvey merge(const Survey& survey, const std::vector<std::string>& names) {
  struct Row {
    int order;
    std::size_t field;
    Eigen::Index at;
  };
  std::vector<Row> rows;
  for (std::size_t f = 0; f < names.size(); ++f) {
    const FieldSurvey& field = survey.at(names[f]);
    for (Eigen::Index i = 0; i < field.values.size(); ++i) {
      rows.push_back({field.order.empty() ? 0 : field.order[i], f, i});
    }
  }
  std::stable_sort(rows.begin(), rows.end(),
                   [](const Row& a, const Row& b) { return a.order < b.order; });
  const auto count = static_cast<Eigen::Index>(rows.size());
  FieldSurvey all{field_core::Places(survey.at(names.front()).places.rows() + 1, count),
                  Eigen::VectorXd(count)};
  for (Eigen::Index i = 0; i < count; ++i) {
    const FieldSurvey& field = survey.at(names[rows[i].field]);
    all.places.col(i) << field.places.col(rows[i].at), static_cast<double>(rows[i].field);
    all.values[i] = field.values[rows[i].at];
  }
  return all;
}

}  // namespace gp_localize
