// Colours and opacities of cells, against values written down by hand.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "field_rviz_plugins/field_image.hpp"

namespace {

using namespace field_rviz_plugins;

field_msgs::FieldMap map_of(std::vector<float> mean, std::vector<float> variance) {
  field_msgs::FieldMap map;
  map.info.width = static_cast<std::uint32_t>(mean.size());
  map.info.height = 1;
  map.info.resolution = 0.5F;
  map.mean = std::move(mean);
  map.variance = std::move(variance);
  return map;
}

Rgb pixel(const FieldImage& image, std::size_t i) {
  return {image.rgba[4 * i], image.rgba[4 * i + 1], image.rgba[4 * i + 2]};
}

// Relative luminance (ITU-R BT.709, without gamma: order is all that is asked).
double luminance(const Rgb& c) { return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]; }

TEST(ColourMap, ViridisHasItsEndsAndGetsBrighterAllTheWay) {
  EXPECT_EQ((Rgb{68, 1, 84}), colour(ColourMap::sequential, 0.0));
  EXPECT_EQ((Rgb{253, 231, 37}), colour(ColourMap::sequential, 1.0));
  EXPECT_EQ(colour(ColourMap::sequential, 1.0), colour(ColourMap::sequential, 7.0));
  double before = -1.0;
  for (int i = 0; i <= 100; ++i) {
    const double now = luminance(colour(ColourMap::sequential, i / 100.0));
    EXPECT_GE(now, before) << i;
    before = now;
  }
}

TEST(ColourMap, TheDivergingOneIsBlueGreyRed) {
  const Rgb low = colour(ColourMap::diverging, 0.0), mid = colour(ColourMap::diverging, 0.5),
            high = colour(ColourMap::diverging, 1.0);
  EXPECT_GT(low[2], low[0] + 100);
  EXPECT_GT(high[0], high[2] + 100);
  EXPECT_NEAR(mid[0], mid[2], 5);
  EXPECT_EQ((Rgb{128, 128, 128}), colour(ColourMap::diverging, std::nan("")));
}

TEST(FieldImage, TheRangeIsThatOfWhatIsKnown) {
  // The last cell is hardly known: its value does not stretch the colours.
  const auto map = map_of({2.0F, 4.0F, 3.0F, 90.0F}, {1.0F, 1.0F, 1.0F, 25.0F});
  const auto image = draw(map, {});
  EXPECT_EQ(2.0, image.low);
  EXPECT_EQ(4.0, image.high);
  EXPECT_EQ(colour(ColourMap::sequential, 0.0), pixel(image, 0));
  EXPECT_EQ(colour(ColourMap::sequential, 1.0), pixel(image, 1));
  EXPECT_EQ(colour(ColourMap::sequential, 0.5), pixel(image, 2));
  ImageOptions options;
  options.quantity = Quantity::stddev;
  EXPECT_EQ(1.0, draw(map, options).low);
  EXPECT_EQ(5.0, draw(map, options).high);
  options = {};
  options.automatic_range = false;
  options.low = 0.0;
  options.high = 8.0;
  EXPECT_EQ(colour(ColourMap::sequential, 0.25), pixel(draw(map, options), 0));
}

TEST(FieldImage, ASignedFieldHasZeroInTheMiddle) {
  ImageOptions options;
  options.colours = ColourMap::diverging;
  const auto image = draw(map_of({-1.0F, 0.0F, 3.0F}, {1.0F, 1.0F, 1.0F}), options);
  EXPECT_EQ(-3.0, image.low);
  EXPECT_EQ(3.0, image.high);
  EXPECT_EQ(colour(ColourMap::diverging, 0.5), pixel(image, 1));
}

TEST(FieldImage, WhatIsNotKnownFades) {
  ImageOptions options;
  options.opacity = 0.8;
  options.fade_unknown = 0.5;
  // Standard deviations 1, 2, 3: the middle one loses half of the half.
  const auto image = draw(map_of({0.0F, 0.0F, 0.0F}, {1.0F, 4.0F, 9.0F}), options);
  EXPECT_EQ(204, image.rgba[3]);   // 0.8
  EXPECT_EQ(153, image.rgba[7]);   // 0.8 * 0.75
  EXPECT_EQ(102, image.rgba[11]);  // 0.8 * 0.5
  const auto even = draw(map_of({0.0F, 0.0F}, {4.0F, 4.0F}), options);
  EXPECT_EQ(204, even.rgba[3]) << "nothing is less known than the rest";
}

TEST(FieldImage, DamagedMapsAreToldApart) {
  auto map = map_of({1.0F, 2.0F}, {1.0F, 1.0F});
  EXPECT_TRUE(is_complete(map));
  map.variance.pop_back();
  EXPECT_FALSE(is_complete(map));
  map = map_of({1.0F, std::numeric_limits<float>::quiet_NaN()}, {1.0F, 1.0F});
  const auto image = draw(map, {});
  EXPECT_EQ((Rgb{128, 128, 128}), pixel(image, 1));
  EXPECT_EQ(1.0, image.high);
}

}  // namespace
