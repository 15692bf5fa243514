// predict() and update() allocate nothing once the map is there, and memory in use stays what it
// was, however long the run. malloc itself is counted: Eigen and the standard library both end
// there.
#include <gtest/gtest.h>
#include <malloc.h>

#include <atomic>

#include "simulated_run.hpp"
#include "vector_field_slam/vector_field_slam.hpp"

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

using namespace vector_field_slam;

namespace {

struct Case {
  const char* name;
  SolverType solver;
  Relocation relocation;
};

class Allocations : public ::testing::TestWithParam<Case> {};

TEST_P(Allocations, NoneInAKnownMap) {
  const simulation::Room room;
  auto p = simulation::params(room);
  p.solver = GetParam().solver;
  p.relocation = GetParam().relocation;
  p.max_nodes = 36;  // most of the room: the rest is refused, as a grown map would allocate
  VectorFieldSlam filter(p, 1);
  auto steps = simulation::simulate(room, 3);
  // All cells of the room first, then the same way over and over.
  field_core::Sample sample{field_core::Stamp(0), {}, std::vector<field_core::Reading>(4)};
  field_core::Stamp now(0);
  int applied = 0;
  const auto drive = [&](std::size_t from, std::size_t to) {
    for (std::size_t t = from; t < to; ++t) {
      const auto next = now + std::chrono::milliseconds(500);
      filter.predict({now, next, steps[t].odometry});
      sample.stamp = next;
      for (int i = 0; i < 4; ++i) sample.readings[i] = {i, steps[t].z[i], 0.0};
      applied += filter.update(sample).applied;
      now = next;
    }
  };
  drive(0, 900);
  const int nodes = filter.solver()->node_count();
  long before = allocations;
  std::size_t in_use = mallinfo2().uordblks;
  drive(900, 1200);
  ASSERT_EQ(filter.solver()->node_count(), nodes)
      << "the room was not all known: choose another seed";
  EXPECT_EQ(allocations - before, 0);
  EXPECT_EQ(mallinfo2().uordblks, in_use);
  EXPECT_GT(applied, 900);
}

INSTANTIATE_TEST_SUITE_P(All, Allocations,
                         ::testing::Values(Case{"window", SolverType::eseif, Relocation::window},
                                           Case{"shared", SolverType::eseif,
                                                Relocation::shared_nodes},
                                           Case{"blank", SolverType::eseif, Relocation::blank},
                                           Case{"ekf", SolverType::ekf, Relocation::window}),
                         [](const auto& info) { return std::string(info.param.name); });

TEST(Allocations, AreCounted) {  // or the test above could not fail
  const long before = allocations;
  std::vector<double> memory(1000);
  EXPECT_GT(allocations - before, 0);
}

}  // namespace
