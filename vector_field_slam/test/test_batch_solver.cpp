// The filter with the batch in the background: same estimates whatever the machine, and better
// ones.
#include <gtest/gtest.h>

#include "field_core/errors.hpp"
#include "simulated_run.hpp"

using namespace vector_field_slam;
using field_core::SE2;

namespace {

/// Estimates of a run, sample by sample.
std::vector<SE2> estimates(const std::vector<simulation::Step>& steps,
                           const VectorFieldSlamParams& params, bool wait = true,
                           int* late = nullptr) {
  VectorFieldSlam filter(params, 1);
  if (wait) filter.wait_for_background();
  std::vector<SE2> result;
  field_core::Stamp now(0);
  for (const auto& s : steps) {
    const auto next = now + std::chrono::milliseconds(500);
    filter.predict({now, next, s.odometry});
    field_core::Sample sample{next, {}, {}};
    for (int i = 0; i < 4; ++i) sample.readings.push_back({i, s.z[i], 0.0});
    const auto update = filter.update(sample);
    if (late) *late += std::string(update.reason).find("late") != std::string::npos;
    result.push_back(filter.belief().mean);
    now = next;
  }
  return result;
}

double error(const std::vector<simulation::Step>& steps, const std::vector<SE2>& estimates) {
  std::vector<SE2> truth;
  for (const auto& s : steps) truth.push_back(s.truth);
  return simulation::align(truth, estimates, {}).mean;
}

bool equal(const SE2& a, const SE2& b) {
  return a.x() == b.x() && a.y() == b.y() && a.yaw() == b.yaw();
}

struct BatchSolverTest : testing::Test {
  BatchSolverTest() {
    setup.steps = 400;
    steps = simulation::simulate(setup, 2);
    params = simulation::params(setup);
  }
  simulation::Room setup;
  std::vector<simulation::Step> steps;
  VectorFieldSlamParams params;
};

TEST_F(BatchSolverTest, ReplaysGiveTheSameBits) {
  params.background_period = 50;
  params.background_delay = 10;
  const auto first = estimates(steps, params), second = estimates(steps, params);
  for (std::size_t t = 0; t < steps.size(); ++t) ASSERT_TRUE(equal(first[t], second[t])) << t;
}

TEST_F(BatchSolverTest, CorrectsAtTheSampleItIsDueAndNotBefore) {
  const auto plain = estimates(steps, params);
  params.background_period = 50;
  params.background_delay = 10;
  const auto corrected = estimates(steps, params);
  // The first start_measurements samples start the filter; the optimization begins with the 50th
  // after those and is due ten later.
  const std::size_t due = static_cast<std::size_t>(params.start_measurements) + 50 + 10 - 1;
  for (std::size_t t = 0; t < due; ++t) ASSERT_TRUE(equal(plain[t], corrected[t])) << t;
  EXPECT_FALSE(equal(plain[due], corrected[due]));
}

TEST_F(BatchSolverTest, ALiveFilterNeverWaitsAndStaysUsable) {
  params.background_period = 10;
  params.background_delay = 1;  // this loop is faster than any optimization
  int late = 0;
  const auto live = estimates(steps, params, false, &late);
  EXPECT_GT(late, 0);  // and says so
  EXPECT_LT(error(steps, live), 0.5);
}

/// The online estimates jump at corrections, so that alignment of the whole run helps them less: no
/// better than the filter's (0.07 m against 0.05 m here), but no more than twice as far off.
TEST_F(BatchSolverTest, CorrectedEstimatesStayGood) {
  const double filter = error(steps, estimates(steps, params));
  params.solver = SolverType::batch;
  const double batch = error(steps, estimates(steps, params));
  std::printf("aligned error: filter %.3f m, corrected %.3f m\n", filter, batch);
  EXPECT_LT(batch, 2.0 * filter);
  EXPECT_GT(batch, 0.01);  // less than a sample's noise could tell
}

/// A filter that is fed sample by sample.
struct Fed {
  VectorFieldSlam filter;
  field_core::Stamp now{0};
  std::size_t next = 0;

  explicit Fed(const VectorFieldSlamParams& params) : filter(params, 1) {
    filter.wait_for_background();
  }
  void run(const std::vector<simulation::Step>& steps, std::size_t until) {
    for (; next < until; ++next) {
      const auto then = now + std::chrono::milliseconds(500);
      filter.predict({now, then, steps[next].odometry});
      field_core::Sample sample{then, {}, {}};
      for (int i = 0; i < 4; ++i) sample.readings.push_back({i, steps[next].z[i], 0.0});
      filter.update(sample);
      now = then;
    }
  }
};

/// Whatever is going on when the state is saved: between corrections, and while one is under way.
struct Saved : BatchSolverTest, testing::WithParamInterface<std::pair<SolverType, int>> {};

TEST_P(Saved, TheRunGoesOnBitForBit) {
  params.solver = GetParam().first;
  params.background_period = 50;
  params.background_delay = 20;
  Fed one(params), other(params);
  one.run(steps, static_cast<std::size_t>(GetParam().second));
  const auto state = one.filter.state();
  EXPECT_EQ(state.numbers().count("job_poses"),
            GetParam().first == SolverType::eseif && GetParam().second == 118 ? 1u : 0u);
  other.filter.restore(state);
  other.now = one.now;
  other.next = one.next;
  for (std::size_t t = one.next; t < 330; ++t) {
    one.run(steps, t);
    other.run(steps, t);
    ASSERT_TRUE(equal(one.filter.belief().mean, other.filter.belief().mean)) << t;
  }
  const auto a = one.filter.state(), b = other.filter.state();
  EXPECT_EQ(a.matrix("trajectory"), b.matrix("trajectory"));
  EXPECT_EQ(a.matrix("batch_counts"), b.matrix("batch_counts"));
  EXPECT_GE(a.matrix("batch_counts")(2), 4.0);  // corrections were made after the restore too
}

INSTANTIATE_TEST_SUITE_P(BatchSolver, Saved,
                         testing::Values(std::make_pair(SolverType::batch, 100),
                                         std::make_pair(SolverType::eseif, 95),
                                         std::make_pair(SolverType::eseif, 118)));

TEST_F(BatchSolverTest, ADamagedLogIsRefusedAndChangesNothing) {
  params.solver = SolverType::batch;
  Fed one(params), other(params);
  one.run(steps, 100);
  other.run(steps, 60);
  const SE2 before = other.filter.belief().mean;
  auto state = one.filter.state();
  Eigen::MatrixXd measurements = state.matrix("log_measurements");
  measurements(0, 7) = 1e6;  // a pose that is not there
  state.set("log_measurements", measurements);
  EXPECT_THROW(other.filter.restore(state), field_core::DataError);
  EXPECT_TRUE(equal(other.filter.belief().mean, before));
}

}  // namespace
