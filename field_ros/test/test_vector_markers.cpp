// Components of a vector field as arrows with ellipses.
#include <gtest/gtest.h>

#include <cmath>

#include "field_ros/vector_markers.hpp"

namespace {

using namespace field_ros;
using visualization_msgs::Marker;

// Two cells of 0.5 m: (3, 4) known exactly there, the other not known yet.
PredictedGrid two_cells() {
  PredictedGrid map;
  map.grid = FieldGrid{1.0, 2.0, 0.5, 2, 1};
  map.fields = {{"mag_x", "uT"}, {"light", "lx"}, {"mag_y", "uT"}};
  map.prediction.mean.resize(3, 2);
  map.prediction.mean << 3.0, 0.0, 100.0, 100.0, 4.0, 0.0;
  map.prediction.variance.resize(3, 2);
  map.prediction.variance << 1.0, 100.0, 0.1, 0.1, 4.0, 100.0;
  map.prediction.prior_variance = Eigen::Vector3d(100.0, 100.0, 100.0);
  map.frame = "map";
  return map;
}

TEST(VectorMarkers, AnArrowWhereBothComponentsAreKnown) {
  const auto markers = to_vector_markers(two_cells()).markers;
  ASSERT_EQ(2u, markers.size());
  const Marker& arrow = markers[0];
  EXPECT_EQ("mag", arrow.ns);
  EXPECT_EQ("map", arrow.header.frame_id);
  EXPECT_DOUBLE_EQ(1.25, arrow.pose.position.x);
  EXPECT_DOUBLE_EQ(2.25, arrow.pose.position.y);
  EXPECT_NEAR(std::atan2(4.0, 3.0), 2.0 * std::asin(arrow.pose.orientation.z), 1e-12);
  EXPECT_NEAR(0.5, arrow.scale.x, 1e-12) << "the only one is as long as a cell";
  // 0.1 m per uT; the 90 % ellipse of stddev 1 and 2 has the half axes 2.146 and 4.292.
  const Marker& ellipse = markers[1];
  EXPECT_NEAR(1.25 + 0.3, ellipse.pose.position.x, 1e-12);
  EXPECT_NEAR(2.25 + 0.4, ellipse.pose.position.y, 1e-12);
  EXPECT_NEAR(2.0 * 0.1 * 2.14597, ellipse.scale.x, 1e-5);
  EXPECT_NEAR(2.0 * 0.1 * 4.29193, ellipse.scale.y, 1e-5);
}

TEST(VectorMarkers, NoneForScalarFields) {
  PredictedGrid map = two_cells();
  map.fields[2].name = "mag_z";
  EXPECT_TRUE(to_vector_markers(map).markers.empty());
}

TEST(VectorMarkers, LargeMapsAreThinned) {
  PredictedGrid map = two_cells();
  map.grid.width = 100, map.grid.height = 50;
  map.prediction.mean = Eigen::MatrixXd::Constant(3, 5000, 1.0);
  map.prediction.variance = Eigen::MatrixXd::Constant(3, 5000, 1.0);
  // Every fifth cell: 20 along x, 10 along y, an arrow and an ellipse each.
  EXPECT_EQ(400u, to_vector_markers(map, 24).markers.size());
}

TEST(VectorMarkers, WhatIsGoneIsDeletedOnce) {
  const auto before = to_vector_markers(two_cells());
  visualization_msgs::MarkerArray now;
  delete_missing(before, now);
  ASSERT_EQ(2u, now.markers.size());
  EXPECT_EQ(Marker::DELETE, now.markers[0].action);
  visualization_msgs::MarkerArray later;
  delete_missing(now, later);
  EXPECT_TRUE(later.markers.empty());
}

}  // namespace
