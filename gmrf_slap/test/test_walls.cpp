// Walls: the prior, the measurements beside them, what a robot learns, states.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <string>

#include "field_core/errors.hpp"
#include "gmrf_slap/field_prior.hpp"
#include "gmrf_slap/gmrf_slap.hpp"
#include "small_worlds.hpp"

using namespace gmrf_slap;
using namespace gmrf_slap::test;
using Eigen::MatrixXd;
using field_core::OccupancyMask;

namespace {

MatrixXd covariance(const Lattice& lattice, const Theta& theta, const Walls& walls = {}) {
  return MatrixXd(prior_precision(lattice, theta, walls)).inverse();
}

/// A wall along y, 0.2 m thick, from y = -1 to 7.
OccupancyMask wall_at(double x) {
  OccupancyMask mask;
  mask.corner = {x, -1.0};
  mask.resolution = 0.2;
  mask.width = 1;
  mask.height = 40;
  mask.occupied.assign(40, 1);
  return mask;
}

TEST(Walls, NoCorrelationPasses) {
  const Lattice lattice({0.0, 0.0}, 1.0, 12, 6, false);
  OccupancyMask mask;
  mask.corner = {5.4, -1.0};  // a wall of 0.2 m between columns 5 and 6
  mask.resolution = 0.2;
  mask.width = 1;
  mask.height = 40;
  mask.occupied.assign(40, 1);
  const Walls walls = walls_from(lattice, mask);
  const MatrixXd sigma = covariance(lattice, {1.0, 0.1, 2}, walls);
  const double across = sigma(lattice.site(5, 3), lattice.site(6, 3));
  EXPECT_EQ(across, 0.0);
  EXPECT_GT(sigma(lattice.site(4, 3), lattice.site(5, 3)), 0.5 * sigma(0, 0));
  EXPECT_LT((sigma.diagonal().array() / sigma(0, 0) - 1.0).abs().maxCoeff(), 1e-9);

  // With a door the way around is long, but there.
  mask.occupied.assign(40, 1);
  for (int j = 6; j < 11; ++j) mask.occupied[static_cast<std::size_t>(j)] = 0;
  const MatrixXd door = covariance(lattice, {1.0, 0.1, 2}, walls_from(lattice, mask));
  const double through = door(lattice.site(5, 5), lattice.site(6, 5));
  EXPECT_GT(through, 0.0);
  EXPECT_LT(through, 0.6 * door(lattice.site(4, 5), lattice.site(5, 5)));
}

TEST(Walls, MaskMayBeTurned) {
  OccupancyMask mask = wall_at(0.0);
  mask.corner = {2.0, 3.0};
  mask.yaw = 0.5 * 3.14159265358979323846;  // its y axis, along which the wall runs, points to -x
  EXPECT_TRUE(mask.at({-1.0, 3.1}));
  EXPECT_FALSE(mask.at({-1.0, 2.9}));
  EXPECT_FALSE(mask.at({2.1, 3.1}));
  EXPECT_TRUE(mask.blocks({0.0, 0.0}, {0.3, 6.0}));
  EXPECT_FALSE(mask.blocks({2.5, 0.0}, {2.5, 6.0}));
}

TEST(Walls, MeasurementsBesideAWallAreOfItsOwnSide) {
  const Lattice lattice({0.0, 0.0}, 1.0, 12, 6, false);
  const Walls walls = walls_from(lattice, wall_at(5.4));
  const SiteRow left = row_within(walls, lattice, {5.3, 2.25}, Interpolation::bilinear);
  ASSERT_EQ(left.count, 2);
  EXPECT_EQ(left.site[0], lattice.site(5, 2));
  EXPECT_EQ(left.site[1], lattice.site(5, 3));
  EXPECT_NEAR(left.weight[0], 0.75, 1e-12);
  EXPECT_NEAR(left.weight[1], 0.25, 1e-12);
  const SiteRow right = row_within(walls, lattice, {5.7, 2.0}, Interpolation::bilinear);
  ASSERT_EQ(right.count, 1);
  EXPECT_EQ(right.site[0], lattice.site(6, 2));
  // Inside of the wall nothing is seen: the nearest site answers.
  EXPECT_EQ(row_within(walls, lattice, {5.5, 2.2}, Interpolation::bilinear).count, 1);
  EXPECT_EQ(row_within(walls, lattice, {4.5, 2.5}, Interpolation::bilinear).count, 4);
}

GmrfSlap robot_beside_a_wall(Engine engine, bool wall) {
  GmrfSlapParams p = small_world(12, 6, {theta(1.0, 0.1)});
  p.engine = engine;
  p.initial_pose_x = 5.0;
  p.initial_pose_y = 3.0;
  GmrfSlap slap(p, 1);
  if (wall) slap.set_obstacles(wall_at(5.4));
  slap.update(sample_of({{0, 2.0, 0.0}}));
  return slap;
}

TEST(Walls, WhatIsLearnedStaysOnItsSideWithEveryEngine) {
  Eigen::Matrix2Xd points(2, 3);
  points.col(0) << 4.0, 3.0;
  points.col(1) << 6.0, 3.0;
  points.col(2) << 5.9, 2.5;  // its cell holds the wall
  const auto open = robot_beside_a_wall(Engine::dense, false).predict_field(points);
  EXPECT_GT(open.mean(0, 1), 0.5);  // without a wall, a metre away: the test sees the difference
  for (const Engine engine : {Engine::dense, Engine::sparse, Engine::local}) {
    const auto learned = robot_beside_a_wall(engine, true).predict_field(points);
    EXPECT_GT(learned.mean(0, 0), 0.5);
    EXPECT_NEAR(learned.mean(0, 1), 0.0, 1e-12);
    EXPECT_NEAR(learned.mean(0, 2), 0.0, 1e-12);
    EXPECT_NEAR(learned.variance(0, 1) / learned.prior_variance(0), 1.0, 1e-8);
  }
}

TEST(Walls, ResetKeepsThem) {
  GmrfSlap slap = robot_beside_a_wall(Engine::dense, true);
  slap.reset();
  slap.update(sample_of({{0, 2.0, 0.0}}));
  EXPECT_NEAR(slap.predict_field(Eigen::Vector2d(6.0, 3.0)).mean(0, 0), 0.0, 1e-12);
}

TEST(Walls, AStateIsRefusedUnderOthers) {
  const GmrfSlap with = robot_beside_a_wall(Engine::dense, true);
  GmrfSlap without = robot_beside_a_wall(Engine::dense, false);
  GmrfSlap other = robot_beside_a_wall(Engine::dense, false);
  other.set_obstacles(wall_at(7.4));
  const auto error = [](GmrfSlap& slap, const field_core::State& state) -> std::string {
    try {
      slap.restore(state);
    } catch (const field_core::DataError& e) {
      return e.what();
    }
    return "accepted";
  };
  EXPECT_NE(error(without, with.state()).find("with walls, this run has none"), std::string::npos);
  EXPECT_NE(error(other, without.state()).find("without walls"), std::string::npos);
  EXPECT_NE(error(other, with.state()).find("with other walls"), std::string::npos);
  GmrfSlap same = robot_beside_a_wall(Engine::dense, false);
  same.set_obstacles(wall_at(5.45));  // cuts the same edges
  EXPECT_EQ(error(same, with.state()), "accepted");
}

}  // namespace
