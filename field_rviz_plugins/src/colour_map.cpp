#include "field_rviz_plugins/colour_map.hpp"

#include <algorithm>
#include <cmath>

namespace field_rviz_plugins {
namespace {

constexpr std::size_t kKnots = 17;
using Table = std::array<Rgb, kKnots>;

// matplotlib's viridis and coolwarm (public domain), every 16th colour; linear in between.
constexpr Table kViridis = {{
    {68, 1, 84},
    {72, 24, 106},
    {71, 45, 123},
    {66, 64, 134},
    {59, 82, 139},
    {51, 99, 141},
    {44, 114, 142},
    {38, 130, 142},
    {33, 145, 140},
    {31, 160, 136},
    {40, 174, 128},
    {63, 188, 115},
    {94, 201, 98},
    {132, 212, 75},
    {173, 220, 48},
    {216, 226, 25},
    {253, 231, 37},
}};
constexpr Table kCoolwarm = {{
    {59, 76, 192},
    {78, 104, 216},
    {98, 130, 234},
    {119, 154, 247},
    {141, 176, 254},
    {163, 194, 254},
    {185, 208, 249},
    {204, 217, 237},
    {221, 220, 220},
    {236, 211, 197},
    {245, 196, 172},
    {247, 176, 147},
    {244, 152, 122},
    {235, 125, 98},
    {221, 95, 75},
    {202, 59, 55},
    {180, 4, 38},
}};
constexpr Rgb kNotANumber = {128, 128, 128};

}  // namespace

Rgb colour(ColourMap map, double position) {
  if (std::isnan(position)) return kNotANumber;
  const Table& table = map == ColourMap::sequential ? kViridis : kCoolwarm;
  const double knot = std::clamp(position, 0.0, 1.0) * (kKnots - 1);
  const auto below = std::min(static_cast<std::size_t>(knot), kKnots - 2);
  const double share = knot - static_cast<double>(below);
  Rgb mixed;
  for (std::size_t i = 0; i < 3; ++i) {
    mixed[i] = static_cast<std::uint8_t>(
        std::lround((1.0 - share) * table[below][i] + share * table[below + 1][i]));
  }
  return mixed;
}

}  // namespace field_rviz_plugins
