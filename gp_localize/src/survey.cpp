#include "gp_localize/survey.hpp"

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
  }
  return survey;
}

Survey read_survey(const std::string& path, const std::vector<std::string>& fields) {
  const auto table = field_core::CsvTable::read(path);
  const std::size_t x = table.column("x_m"), y = table.column("y_m");
  SurveyBuilder builder;
  for (const std::string& name : fields.empty() ? field_columns(table) : fields) {
    const std::size_t column = table.column(name);
    bool measured = false;
    for (std::size_t row = 0; row < table.rows(); ++row) {
      if (table.empty(row, column)) continue;
      builder.add(name, {table.number(row, x), table.number(row, y)}, table.number(row, column));
      measured = true;
    }
    if (!measured) {
      throw field_core::DataError(path + ": column '" + name +
                                  "' has no measurement; leave the field out");
    }
  }
  return builder.build();
}

}  // namespace gp_localize
