// A support set that grows where the robot leaves what it covers.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "../src/particle_map.hpp"
#include "dense_reference.hpp"
#include "gp_localize/gp_localize.hpp"

using namespace gp_localize;
using field_core::SE2;
using std::chrono::seconds;

namespace {

const field_core::Kernel kKernel(field_core::KernelType::matern52, 1.3, {1.5, 2.0});
constexpr double kJitter = 1e-6;

Eigen::Matrix2Xd some_points(int count, double spread, std::uint64_t seed) {
  field_core::Random random(seed);
  Eigen::Matrix2Xd points(2, count);
  for (int i = 0; i < count; ++i)
    points.col(i) << spread * random.normal(), spread * random.normal();
  return points;
}

TEST(SupportGrowth, BasisIsThatOfAllPointsFromTheStart) {
  const Eigen::Matrix2Xd points = some_points(9, 3.0, 1), places = some_points(30, 4.0, 2);
  SupportBasis grown(kKernel, points.leftCols(6), kJitter, 0.0, 3);
  for (int i = 6; i < 9; ++i) {
    ASSERT_TRUE(grown.has_room());
    const auto phi = test::gamma(
        test::DenseField{kKernel, points.leftCols(i), kJitter * kKernel.signal_variance(), 0.0},
        points.col(i), points.col(i));
    EXPECT_NEAR(grown.unexplained(points.col(i)), 1.0 - phi(0, 0) / kKernel.signal_variance(),
                1e-9);
    grown.grow(points.col(i));
  }
  EXPECT_FALSE(grown.has_room());
  const SupportBasis whole(kKernel, points, kJitter, 0.0);
  Features a, b;
  grown.features(places, a);
  whole.features(places, b);
  EXPECT_NEAR((a - b).cwiseAbs().maxCoeff(), 0.0, 1e-9);
  grown.forget_grown();
  grown.features(places, a);
  SupportBasis(kKernel, points.leftCols(6), kJitter, 0.0).features(places, b);
  EXPECT_EQ(a.topRows(6), b);
  EXPECT_EQ(a.bottomRows(3).cwiseAbs().maxCoeff(), 0.0);
}

double light_at(const SE2& pose) {
  return 2.0 * std::sin(0.9 * pose.x()) * std::cos(0.7 * pose.y());
}

/// Exact odometry along a line that leaves the region at x = 3, and back.
GpLocalizeParams params(int budget) {
  GpLocalizeParams p;
  FieldParams f;
  f.signal_stddev = 1.4;
  f.noise_stddev = 0.1;
  f.length_scales = {1.5, 1.5};
  p.fields = {{"light", f}};
  p.particles = 3;
  p.slice_size = 5;
  p.support.region = {-3.0, -3.0, 3.0, 3.0};
  p.support.size = 16;
  p.support.budget = budget;
  p.support.grow_at = 0.4;
  p.odometry_noise = {0.0, 0.0, 0.0, 0.0};
  p.initial_pose_x = -2.0;
  p.initial_cov_xx = p.initial_cov_yy = p.initial_cov_aa = 0.0;
  return p;
}

/// Drives from x = -2 to where it ends; returns the last pose.
SE2 drive(GpLocalize& filter, int from, int to) {
  SE2 pose(-2.0 + 0.2 * from, 0.0, 0.0);
  for (int t = from; t < to; ++t) {
    pose = pose * SE2(0.2, 0.0, 0.0);
    filter.predict({seconds(t), seconds(t + 1), SE2(0.2, 0.0, 0.0)});
    filter.update({seconds(t + 1), {}, {{0, light_at(pose), 0.0}}});
  }
  return pose;
}

double error_at(const GpLocalize& filter, double x) {
  const SE2 pose(x, 0.0, 0.0);
  return std::abs(filter.predict_field(pose.translation()).mean(0, 0) - light_at(pose));
}

TEST(SupportGrowth, InsideTheRegionNothingChanges) {
  GpLocalize fixed(params(0), 1), growing(params(12), 1);
  drive(fixed, 0, 20);  // up to x = 2
  drive(growing, 0, 20);
  for (double x = -3.0; x <= 3.0; x += 0.25) {
    const Eigen::Matrix2Xd place = Eigen::Vector2d(x, 0.4);
    const auto a = fixed.predict_field(place), b = growing.predict_field(place);
    EXPECT_NEAR(a.mean(0, 0), b.mean(0, 0), 1e-12);
    EXPECT_NEAR(a.variance(0, 0), b.variance(0, 0), 1e-12);
  }
  EXPECT_EQ(fixed.map_region().x_max, growing.map_region().x_max);
}

TEST(SupportGrowth, RemembersTheFieldOutsideTheRegion) {
  GpLocalize fixed(params(0), 1), growing(params(12), 1);
  drive(fixed, 0, 60);  // up to x = 10
  drive(growing, 0, 60);
  EXPECT_GT(growing.map_region().x_max, 9.0);
  double without = 0.0, with = 0.0;
  for (double x = 4.5; x <= 8.5; x += 0.25) {  // slices that are closed by now
    without += error_at(fixed, x) / 17;
    with += error_at(growing, x) / 17;
  }
  RecordProperty("without", std::to_string(without));
  RecordProperty("with", std::to_string(with));
  EXPECT_GT(without, 0.8);  // as good as the prior mean: mean |light| is 1.3
  EXPECT_LT(with, 0.2);
}

/// Three particles side by side along a line; the last slice is closed.
void measure(ParticleMap& map, int steps) {
  field_core::Random random(1);
  ParticleSet particles(3);
  for (int t = 0; t < steps; ++t) {
    for (int i = 0; i < 3; ++i) {
      particles[i].weight = 1.0 / 3;
      particles[i].pose = SE2(-2.0 + 0.5 * t, 0.2 * i, 0.0);
    }
    std::vector<double> log_likelihood;
    Innovation innovation;
    const std::vector<Observation> z{{0, std::sin(0.8 * t), 0.01, 0.01}};
    map.weigh(particles, SE2(), z, log_likelihood, innovation);
    map.learn(particles, SE2(), z, random);
  }
  map.relocate(particles, random);
}

TEST(SupportGrowth, WithinASliceItIsTheWholeSetFromTheStart) {
  GpLocalizeParams p = params(12);
  p.slice_size = 30;
  const auto fields = make_field_models(p);
  ParticleMap growing(p, fields);
  measure(growing, 25);
  const Eigen::Matrix2Xd grown = growing.grown_support();
  ASSERT_GT(grown.cols(), 3);
  p.support.selection = SupportSelection::explicit_points;
  const Eigen::Matrix2Xd first = fields[0].basis.support();
  for (const Eigen::Vector2d point : first.colwise()) p.support.points.push_back(point);
  for (const Eigen::Vector2d point : grown.colwise()) p.support.points.push_back(point);
  p.support.budget = 0;
  ParticleMap fixed(p, make_field_models(p));
  measure(fixed, 25);
  ParticleSet particles(3);
  for (Particle& particle : particles) particle.weight = 1.0 / 3;
  const Eigen::Matrix2Xd places = some_points(40, 5.0, 4);
  Eigen::VectorXd mean_a, mean_b, variance_a, variance_b;
  growing.predict(0, places, particles, mean_a, variance_a);
  fixed.predict(0, places, particles, mean_b, variance_b);
  // Jitter 1e-8: condition 1e8 of the support times rounding.
  EXPECT_NEAR((mean_a - mean_b).cwiseAbs().maxCoeff(), 0.0, 1e-6);
  EXPECT_NEAR((variance_a - variance_b).cwiseAbs().maxCoeff(), 0.0, 1e-6);
}

TEST(SupportGrowth, StopsAtItsBudget) {
  const GpLocalizeParams p = params(3);
  const auto fields = make_field_models(p);
  ParticleMap map(p, fields);
  measure(map, 50);
  EXPECT_EQ(map.grown_support().cols(), 3);
}

TEST(SupportGrowth, IsSavedRestoredAndReset) {
  const GpLocalizeParams p = params(12);
  GpLocalize first(p, 1), second(p, 1), fresh(p, 1);
  drive(first, 0, 40);
  second.restore(first.state());
  EXPECT_EQ(first.map_region().x_max, second.map_region().x_max);
  drive(first, 40, 60);
  drive(second, 40, 60);
  EXPECT_EQ(first.map_region().x_max, second.map_region().x_max);
  for (double x = 0.0; x < 10.0; x += 0.5) EXPECT_EQ(error_at(first, x), error_at(second, x));
  first.reset();
  EXPECT_EQ(first.map_region().x_max, 3.0);
  drive(first, 0, 30);
  drive(fresh, 0, 30);
  for (double x = 0.0; x < 10.0; x += 0.5) EXPECT_EQ(error_at(first, x), error_at(fresh, x));
}

}  // namespace
