#include "field_ros/map_files.hpp"

#include <cmath>

#include "field_core/csv.hpp"

namespace field_ros {
namespace {

using field_core::format_number;

constexpr char kUnknownPixel = '\xff';
constexpr const char* kNoData = "-9999";

// Images and ASCII grids begin at the top, where y is largest.
template <class OnCell, class OnRowEnd>
void from_the_top(const FieldGrid& grid, OnCell on_cell, OnRowEnd on_row_end) {
  for (int row = grid.height - 1; row >= 0; --row) {
    for (int column = 0; column < grid.width; ++column) {
      on_cell(static_cast<std::size_t>(column) +
              static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.width));
    }
    on_row_end();
  }
}

std::string to_pgm(const FieldGrid& grid, const nav_msgs::OccupancyGrid& scaled) {
  std::string text =
      "P5\n" + std::to_string(grid.width) + " " + std::to_string(grid.height) + "\n255\n";
  from_the_top(
      grid,
      [&](std::size_t cell) {
        const std::int8_t value = scaled.data[cell];
        text += value < 0 ? kUnknownPixel : static_cast<char>(value);
      },
      [] {});
  return text;
}

std::string to_yaml(const FieldGrid& grid, const std::string& name, const std::string& unit,
                    const ValueRange& range) {
  return "# " + name + ": pixel 0 is " + format_number(range.low) + " " + unit + ", 100 is " +
         format_number(range.high) + " " + unit + ", 255 is not known yet\nimage: field_" + name +
         ".pgm\nmode: raw\nresolution: " + format_number(grid.resolution) + "\norigin: [" +
         format_number(grid.x_min) + ", " + format_number(grid.y_min) +
         ", 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
}

std::string to_asc(const PredictedGrid& map, std::size_t field, bool stddev,
                   const nav_msgs::OccupancyGrid& scaled) {
  const FieldGrid& grid = map.grid;
  std::string text = "ncols " + std::to_string(grid.width) + "\nnrows " +
                     std::to_string(grid.height) + "\nxllcorner " + format_number(grid.x_min) +
                     "\nyllcorner " + format_number(grid.y_min) + "\ncellsize " +
                     format_number(grid.resolution) + "\nNODATA_value " + kNoData + "\n";
  const auto row = static_cast<Eigen::Index>(field);
  from_the_top(
      grid,
      [&](std::size_t cell) {
        const auto column = static_cast<Eigen::Index>(cell);
        const double value = stddev ? std::sqrt(map.prediction.variance(row, column))
                                    : map.prediction.mean(row, column);
        text += (scaled.data[cell] < 0 ? std::string(kNoData) : format_number(value)) + " ";
      },
      [&text] { text.back() = '\n'; });
  return text;
}

}  // namespace

std::map<std::string, std::string> map_files(const PredictedGrid& map) {
  std::map<std::string, std::string> files;
  for (std::size_t field = 0; field < map.fields.size(); ++field) {
    for (const bool stddev : {false, true}) {
      const std::string name = map.fields[field].name + (stddev ? "_stddev" : "");
      const auto scaled = to_occupancy_grid(map, field, stddev);
      files["field_" + name + ".pgm"] = to_pgm(map.grid, scaled);
      files["field_" + name + ".yaml"] =
          to_yaml(map.grid, name, map.fields[field].unit, known_range(map, field, stddev));
      files["field_" + name + ".asc"] = to_asc(map, field, stddev, scaled);
    }
  }
  return files;
}

}  // namespace field_ros
