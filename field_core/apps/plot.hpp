// The pictures, drawn by plot_trajectory_errors.py.
#pragma once

#include <string>

#include "evaluation.hpp"

namespace field_eval {

struct PlotOptions {
  std::string output;    ///< picture to write; .png, .pdf or .svg
  std::string map;       ///< field_<name>.csv with columns x_m,y_m,mean,variance; empty: no map
  std::string map_unit;  ///< unit of the field, for the colour bar
  std::string title;
};

/// @throws DataError with the script's own words if it fails; no picture is left then
void plot(const Evaluation& evaluation, const PlotOptions& options);

}  // namespace field_eval
