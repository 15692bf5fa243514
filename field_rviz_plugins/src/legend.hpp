// The legend of a field map: name, unit, colour bar with round numbers.
#pragma once

#include <QImage>
#include <string>
#include <vector>

#include "field_rviz_plugins/field_image.hpp"

namespace field_rviz_plugins {

/// Round numbers (1, 2 or 5 times a power of ten apart) inside [low, high], three to seven of them;
/// only `low` if the range is empty.
std::vector<double> ticks(double low, double high);

/// @param title such as "ap1" @param unit such as "dBm"; "" or "1": none
QImage draw_legend(const std::string& title, const std::string& unit, ColourMap colours, double low,
                   double high);

}  // namespace field_rviz_plugins
