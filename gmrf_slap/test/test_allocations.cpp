// predict() and update() allocate nothing once warm, and memory in use stays what it was, however
// long the run. malloc itself is counted: Eigen and the standard library both end there.
#include <gtest/gtest.h>
#include <malloc.h>

#include <atomic>
#include <cmath>

#include "gmrf_slap/gmrf_slap.hpp"
#include "small_worlds.hpp"

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

using namespace gmrf_slap;
using field_core::SE2;
using std::chrono::seconds;

namespace {

TEST(Allocations, NoneAfterWarmUp) {
  GmrfSlapParams p = test::small_world(12, 12, {test::theta(1.0, 0.2), test::theta(0.2, 0.8)});
  p.fields["b"].hyperparameters = {test::theta(1.0, 0.5)};
  p.particles = 50;
  p.lag = 20;
  p.initial_pose_x = p.initial_pose_y = 4.0;
  p.odometry_noise = {0.01, 0.01, 0.01, 0.01};
  GmrfSlap filter(p, 1);

  SE2 truth(4.0, 4.0, 0.0);
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
  drive(0, 300);  // every trajectory has been full and merged
  const long before = allocations;
  const std::size_t in_use = mallinfo2().uordblks;
  drive(300, 3000);
  EXPECT_EQ(allocations - before, 0);
  EXPECT_EQ(mallinfo2().uordblks, in_use);
}

TEST(Allocations, AreCounted) {  // or the test above could not fail
  const long before = allocations;
  std::vector<double> memory(1000);
  EXPECT_GT(allocations - before, 0);
}

}  // namespace
