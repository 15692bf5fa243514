// Occupancy grids as masks: values, placement, refusals.
#include <gtest/gtest.h>

#include <limits>

#include "field_core/errors.hpp"
#include "field_ros/obstacles.hpp"
#include "test_support.hpp"
#include "toy_estimator.hpp"

namespace {

using namespace field_ros;
using field_ros_test::error_of;

/// Three cells of 0.5 m in a row along y from (1, 2): the grid's x axis points along the map's y.
nav_msgs::OccupancyGrid row_along_y() {
  nav_msgs::OccupancyGrid map;
  map.header.frame_id = "/map";
  map.info.resolution = 0.5F;
  map.info.width = 3;
  map.info.height = 1;
  map.info.origin = to_pose(field_core::SE2(1.0, 2.0, 0.5 * 3.14159265358979323846));
  map.data = {64, 65, -1};
  return map;
}

TEST(Obstacles, AreWhatIsOccupiedForMapServer) {
  const field_core::OccupancyMask mask = to_mask(row_along_y(), "map");
  EXPECT_FALSE(mask.at({0.75, 2.25}));  // 64: free
  EXPECT_TRUE(mask.at({0.75, 2.75}));
  EXPECT_FALSE(mask.at({0.75, 3.25}));  // unknown
  EXPECT_FALSE(mask.at({1.25, 2.75}));  // beside it
}

TEST(Obstacles, RefusesWhatCannotBeUsed) {
  const auto refused = [](const auto& spoil) {
    nav_msgs::OccupancyGrid map = row_along_y();
    spoil(map);
    return error_of([&] { to_mask(map, "map"); });
  };
  using Map = nav_msgs::OccupancyGrid;
  EXPECT_NE(refused([](Map& m) { m.header.frame_id = "odom"; }).find("frame 'odom'"),
            std::string::npos);
  EXPECT_NE(refused([](Map& m) { m.data.pop_back(); }).find("it has 2 cells, its size is 3 x 1"),
            std::string::npos);
  EXPECT_NE(refused([](Map& m) {
              m.data.clear();
              m.info.width = 0;
            }).find("it has 0 cells"),
            std::string::npos);
  EXPECT_NE(refused([](Map& m) { m.info.resolution = 0.0F; }).find("resolution"),
            std::string::npos);
  EXPECT_NE(refused([](Map& m) { m.info.origin.orientation.x = 0.7; }).find("origin"),
            std::string::npos);
  EXPECT_NE(refused([](Map& m) {
              m.info.origin.position.x = std::numeric_limits<double>::quiet_NaN();
            }).find("origin"),
            std::string::npos);
}

TEST(Obstacles, AreRefusedForAnEstimatorThatKnowsNone) {
  const auto tree = ParamTree::from_yaml_text("noise_stddev: 0.5\nuse_map_topic: true\n", "c.yaml");
  const std::string error =
      error_of([&] { estimator_entry<field_ros_test::ToyEstimator>().make(tree, std::nullopt); });
  EXPECT_NE(error.find("'use_map_topic'"), std::string::npos) << error;
  EXPECT_NE(error.find("know no walls"), std::string::npos) << error;
}

}  // namespace
