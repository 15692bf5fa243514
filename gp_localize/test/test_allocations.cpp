// predict() and update() allocate nothing once warm, and memory in use stays what it was, however
// long the run. malloc itself is counted: Eigen and the standard library both end there.
#include <gtest/gtest.h>
#include <malloc.h>

#include <atomic>
#include <cmath>

#include "gp_localize/gp_localize.hpp"

namespace {
std::atomic<long> allocations{0};
}

extern "C" {
void* __libc_malloc(std::size_t size);
void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}
}

using namespace gp_localize;
using field_core::SE2;
using std::chrono::seconds;

namespace {

struct Case {
  MapHypotheses map;
  ObservationModelType model;
  bool correlated = false;
};

class Allocations : public ::testing::TestWithParam<Case> {};

TEST_P(Allocations, NoneAfterWarmUp) {
  GpLocalizeParams p;
  FieldParams f;
  f.length_scales = {2.0, 2.0};
  p.fields = {{"a", f}, {"b", f}};
  p.map_hypotheses = GetParam().map;
  p.observation_model = GetParam().model;
  p.particles = 50;
  p.sample_paths = 30;
  p.support.region = {-5.0, -5.0, 5.0, 5.0};
  p.odometry_noise = {0.01, 0.01, 0.01, 0.01};
  p.odom_calibration.translation_stddev = 0.05;
  if (GetParam().correlated) p.coregionalization = {{"all", {{"a", "b"}, {0.5}}}};
  GpLocalize filter(p, 1);

  SE2 truth;
  field_core::Sample sample{seconds(0), {}, {{0, 0.0, 0.0}, {1, 0.0, 0.0}}};
  const auto drive = [&](int from, int to) {
    for (int t = from; t < to; ++t) {
      truth = truth * SE2(0.3, 0.0, 0.15);
      sample.stamp = seconds(t + 1);
      sample.readings[0].value = std::sin(truth.x());
      sample.readings[1].value = std::cos(truth.y());
      filter.predict({seconds(t), seconds(t + 1), SE2(0.3, 0.0, 0.15)});
      ASSERT_TRUE(filter.update(sample).applied);
    }
  };
  drive(0, 300);  // every particle has owned a map, every slice has been full
  const long before = allocations;
  const std::size_t in_use = mallinfo2().uordblks;
  drive(300, 3000);
  EXPECT_EQ(allocations - before, 0);
  EXPECT_EQ(mallinfo2().uordblks, in_use);
}

INSTANTIATE_TEST_SUITE_P(
    Models, Allocations,
    ::testing::Values(Case{MapHypotheses::sample_paths, ObservationModelType::online_pitc},
                      Case{MapHypotheses::sample_paths,
                           ObservationModelType::online_pitc_assimilated},
                      Case{MapHypotheses::particle, ObservationModelType::online_pitc},
                      Case{MapHypotheses::particle, ObservationModelType::fitc},
                      Case{MapHypotheses::particle, ObservationModelType::online_pitc, true},
                      Case{MapHypotheses::sample_paths, ObservationModelType::online_pitc, true}));

// One field of a group alone is weighed otherwise than both.
TEST(Allocations, NoneForOneFieldOfAGroup) {
  GpLocalizeParams p;
  FieldParams f;
  f.length_scales = {2.0, 2.0};
  p.fields = {{"a", f}, {"b", f}};
  p.coregionalization = {{"all", {{"a", "b"}, {0.5}}}};
  p.map_hypotheses = MapHypotheses::sample_paths;
  p.particles = 200;
  p.sample_paths = 30;
  p.support.region = {-5.0, -5.0, 5.0, 5.0};
  p.odometry_noise = {0.01, 0.01, 0.01, 0.01};
  GpLocalize filter(p, 1);
  SE2 truth;
  field_core::Sample sample{seconds(0), {}, {{0, 0.0, 0.0}}};
  long before = 0;
  for (int t = 0; t < 600; ++t) {
    if (t == 300) before = allocations;
    truth = truth * SE2(0.3, 0.0, 0.15);
    sample.stamp = seconds(t + 1);
    sample.readings[0] = {t % 2, std::sin(truth.x()), 0.0};
    filter.predict({seconds(t), seconds(t + 1), SE2(0.3, 0.0, 0.15)});
    ASSERT_TRUE(filter.update(sample).applied);
  }
  EXPECT_EQ(allocations - before, 0);
}

// The pose is lost and found again and again, so that the number of particles goes up and down.
TEST(Allocations, NoneWhileTheNumberOfParticlesVaries) {
  GpLocalizeParams p;
  FieldParams f;
  f.length_scales = {2.0, 2.0};
  f.noise_stddev = 0.3;
  p.fields = {{"a", f}, {"b", f}};
  p.particles = 200;
  p.adaptive.min_particles = 10;
  p.adaptive.kld_err = 0.5;
  p.support.region = {-5.0, -5.0, 5.0, 5.0};
  p.initial_cov_xx = p.initial_cov_yy = p.initial_cov_aa = 1e-4;
  p.odometry_noise = {0.01, 0.01, 0.01, 0.01};
  GpLocalize filter(p, 1);
  SE2 truth;
  field_core::Sample sample{seconds(0), {}, {{0, 0.0, 0.0}, {1, 0.0, 0.0}}};
  long allocated = 0;
  std::size_t fewest = 200, most = 0;
  for (int t = 0; t < 400; ++t) {
    if (t % 100 == 0) filter.scatter();
    if (t % 100 == 50) filter.set_pose(truth, 1e-4 * Eigen::Matrix3d::Identity());
    truth = truth * SE2(0.3, 0.0, 0.15);
    sample.stamp = seconds(t + 1);
    sample.readings[0].value = std::sin(truth.x());
    sample.readings[1].value = std::cos(truth.y());
    const long before = allocations;
    filter.predict({seconds(t), seconds(t + 1), SE2(0.3, 0.0, 0.15)});
    filter.update(sample);
    if (t >= 100) allocated += allocations - before;
    const std::size_t count = filter.belief().particles.size();
    fewest = std::min(fewest, count);
    most = std::max(most, count);
  }
  EXPECT_EQ(allocated, 0);
  EXPECT_LT(fewest, most);  // or nothing was tested
}

TEST(Allocations, AreCounted) {  // or the test above could not fail
  const long before = allocations;
  std::vector<double> memory(1000);
  EXPECT_GT(allocations - before, 0);
}

}  // namespace
