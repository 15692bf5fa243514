// Merge by stamp: brackets, interpolation, order, bounds and clocks that jump.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "field_core/random.hpp"
#include "field_ros/stream_merge.hpp"

namespace {

using field_core::Sample;
using field_core::SE2;
using field_core::stamp_from_seconds;
using field_ros::DropReason;
using field_ros::MergedStep;
using field_ros::MergeLimits;
using field_ros::OdometrySample;
using field_ros::StreamMerge;

OdometrySample odom(double t, double x) { return {stamp_from_seconds(t), SE2(x, 0.0, 0.0)}; }

Sample sample(double t) {
  Sample s;
  s.stamp = stamp_from_seconds(t);
  s.readings = {{0, t, 0.0}};
  return s;
}

struct Merge {
  explicit Merge(MergeLimits limits = {})
      : merge(limits, [this](DropReason reason) { ++drops[reason]; }) {}
  std::vector<MergedStep> ready(bool end = false) {
    std::vector<MergedStep> steps;
    while (auto step = merge.next(end)) steps.push_back(*step);
    return steps;
  }
  std::map<DropReason, int> drops;
  StreamMerge merge;
};

TEST(StreamMerge, WaitsForTheBracketAndInterpolates) {
  Merge m;
  m.merge.add_odometry(odom(1.0, 10.0));
  m.merge.add_sample(sample(1.25));
  EXPECT_TRUE(m.ready().empty());
  m.merge.add_odometry(odom(2.0, 14.0));
  const auto steps = m.ready();
  ASSERT_EQ(1u, steps.size());
  EXPECT_NEAR(11.0, steps[0].odom_pose.x(), 1e-12);
  EXPECT_NEAR(1.0, steps[0].increment.delta.x(), 1e-12);
  EXPECT_EQ(stamp_from_seconds(1.0), steps[0].increment.from);
  EXPECT_EQ(stamp_from_seconds(1.25), steps[0].increment.to);
}

TEST(StreamMerge, IncrementsFollowAnArcAndAddUpToTheOdometry) {
  Merge m;
  // A quarter circle of radius 1 to the left, in one second.
  m.merge.add_odometry({stamp_from_seconds(0.0), SE2(0, 0, 0)});
  m.merge.add_odometry({stamp_from_seconds(1.0), SE2(1, 1, M_PI / 2)});
  for (const double t : {0.25, 0.5, 1.0}) m.merge.add_sample(sample(t));
  const auto steps = m.ready();
  ASSERT_EQ(3u, steps.size());
  EXPECT_NEAR(std::sin(M_PI / 4), steps[1].odom_pose.x(), 1e-12);
  EXPECT_NEAR(1.0 - std::cos(M_PI / 4), steps[1].odom_pose.y(), 1e-12);
  SE2 sum;
  for (const auto& step : steps) sum = sum * step.increment.delta;
  EXPECT_NEAR(1.0, sum.x(), 1e-12);
  EXPECT_NEAR(1.0, sum.y(), 1e-12);
  EXPECT_NEAR(M_PI / 2, sum.yaw(), 1e-12);
}

TEST(StreamMerge, DropsWhatIsTooOld) {
  Merge m;
  m.merge.add_sample(sample(0.5));  // before any odometry: cannot be judged yet
  EXPECT_TRUE(m.ready().empty());
  m.merge.add_odometry(odom(1.0, 0.0));
  m.merge.add_odometry(odom(2.0, 1.0));
  m.merge.add_sample(sample(1.8));
  EXPECT_EQ(1u, m.ready().size());
  EXPECT_EQ(1, m.drops[DropReason::before_odometry]);
  m.merge.add_sample(sample(1.7));
  EXPECT_TRUE(m.ready().empty());
  EXPECT_EQ(1, m.drops[DropReason::older_than_processed]);
  m.merge.add_sample(sample(1.8));  // the same time is not older
  EXPECT_EQ(1u, m.ready().size());
}

TEST(StreamMerge, QueuesAreBounded) {
  MergeLimits limits;
  limits.pending = 3;
  limits.odometry = 2;
  Merge m(limits);
  for (const double t : {1.0, 2.0, 3.0, 4.0}) m.merge.add_odometry(odom(t, t));
  m.merge.add_sample(sample(1.5));
  EXPECT_TRUE(m.ready().empty());
  EXPECT_EQ(1, m.drops[DropReason::older_than_buffer]);
  for (int i = 0; i < 5; ++i) m.merge.add_sample(sample(10.0 + i));
  EXPECT_EQ(3u, m.merge.pending());
  EXPECT_EQ(2, m.drops[DropReason::queue_full]);
  m.merge.add_odometry(odom(14.0, 14.0));
  const auto steps = m.ready();  // the oldest were given up
  ASSERT_EQ(3u, steps.size());
  EXPECT_EQ(stamp_from_seconds(12.0), steps[0].sample.stamp);
}

TEST(StreamMerge, OneStrayOdometryChangesNothing) {
  Merge m;
  m.merge.add_odometry(odom(100.0, 0.0));
  for (const double stray : {3.0, 5000.0}) {
    EXPECT_FALSE(m.merge.add_odometry(odom(stray, 99.0)));
    EXPECT_FALSE(
        m.merge.add_odometry(odom(m.merge.newest_odometry()->stamp.count() * 1e-9 + 1.0, 1.0)));
  }
  EXPECT_EQ(2, m.drops[DropReason::odometry_stray_stamp]);
  EXPECT_FALSE(m.merge.add_odometry(odom(101.5, 0.0)));  // a little late: dropped alone
  EXPECT_EQ(1, m.drops[DropReason::odometry_out_of_order]);
  EXPECT_EQ(stamp_from_seconds(102.0), m.merge.newest_odometry()->stamp);
}

TEST(StreamMerge, TwoOdometriesBackAreARestartedClock) {
  Merge m;
  m.merge.add_odometry(odom(100.0, 0.0));
  m.merge.add_odometry(odom(101.0, 1.0));
  m.merge.add_sample(sample(101.0));
  EXPECT_EQ(1u, m.ready().size());
  m.merge.add_sample(sample(150.0));
  EXPECT_FALSE(m.merge.add_odometry(odom(10.0, 7.0)));
  m.merge.add_sample(sample(10.2));  // of the new time already
  EXPECT_TRUE(m.merge.add_odometry(odom(10.5, 8.0)));
  const auto steps = m.ready();
  ASSERT_EQ(1u, steps.size());
  EXPECT_EQ(stamp_from_seconds(10.2), steps[0].sample.stamp);
  EXPECT_NEAR(0.4, steps[0].increment.delta.x(), 1e-12);
  EXPECT_EQ(0u, m.merge.pending());  // 150.0 belonged to the old time
  EXPECT_TRUE(m.drops.empty());
}

TEST(StreamMerge, TwoOdometriesBackInTheWrongOrderAreNot) {
  Merge m;
  m.merge.add_odometry(odom(100.0, 0.0));
  EXPECT_FALSE(m.merge.add_odometry(odom(10.5, 0.0)));
  EXPECT_FALSE(m.merge.add_odometry(odom(10.0, 0.0)));
  EXPECT_FALSE(m.merge.add_odometry(odom(100.1, 0.0)));
  EXPECT_EQ(2, m.drops[DropReason::odometry_stray_stamp]);
}

TEST(StreamMerge, AConfirmedGapIsDrivenThrough) {
  Merge m;
  m.merge.add_odometry(odom(0.0, 0.0));
  EXPECT_FALSE(m.merge.add_odometry(odom(60.0, 30.0)));
  EXPECT_FALSE(m.merge.add_odometry(odom(61.0, 31.0)));
  m.merge.add_sample(sample(61.0));
  const auto steps = m.ready();
  ASSERT_EQ(1u, steps.size());
  EXPECT_NEAR(31.0, steps[0].increment.delta.x(), 1e-12);
}

TEST(StreamMerge, AnchorMovesToAKnownTimeOrTheNewest) {
  Merge m;
  EXPECT_FALSE(m.merge.move_anchor(stamp_from_seconds(1.0)));
  m.merge.add_odometry(odom(1.0, 0.0));
  m.merge.add_odometry(odom(3.0, 4.0));
  EXPECT_TRUE(m.merge.move_anchor(stamp_from_seconds(2.0)));
  EXPECT_NEAR(2.0, m.merge.anchor()->pose.x(), 1e-12);
  EXPECT_TRUE(m.merge.move_anchor(stamp_from_seconds(0.0)));
  EXPECT_EQ(stamp_from_seconds(3.0), m.merge.anchor()->stamp);
}

// Messages in the order in which they arrive when each is late by up to `skew` (odometry stays in
// order).
std::vector<std::pair<double, int>> arrivals(field_core::Random& random, int odometries,
                                             int samples, double skew) {
  std::vector<std::pair<double, int>> order;  // arrival time; odometry i as i, sample i as -1 - i
  for (int i = 0; i < odometries; ++i) order.emplace_back(0.1 * i, i);
  for (int i = 0; i < samples; ++i)
    order.emplace_back(0.033 * (i + 1) + skew * random.uniform(), -1 - i);
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  return order;
}

TEST(StreamMerge, ArrivalOrderWithinTheWindowNeverChangesTheOutput) {
  constexpr int kOdometries = 60, kSamples = 150;
  MergeLimits limits;
  limits.reorder_window = stamp_from_seconds(0.5);
  std::vector<MergedStep> reference;
  field_core::Random random(7);
  for (int round = 0; round < 200; ++round) {
    Merge m(limits);
    std::vector<MergedStep> steps;
    for (const auto& [arrival, what] :
         arrivals(random, kOdometries, kSamples, round == 0 ? 0.0 : 0.5)) {
      if (what >= 0) {
        m.merge.add_odometry(
            {stamp_from_seconds(0.1 * what), SE2(0.1 * what, std::sin(0.1 * what), 0.3 * what)});
      } else {
        m.merge.add_sample(sample(0.033 * -what));
      }
      for (auto& step : m.ready()) steps.push_back(step);
    }
    for (auto& step : m.ready(true)) steps.push_back(step);
    if (round == 0) reference = steps;
    ASSERT_EQ(kSamples, static_cast<int>(steps.size())) << round;
    EXPECT_TRUE(m.drops.empty()) << round;
    for (std::size_t i = 0; i < steps.size(); ++i) {
      ASSERT_EQ(reference[i].sample.stamp, steps[i].sample.stamp) << round;
      // Bit for bit: the same numbers in the same order.
      ASSERT_EQ(reference[i].increment.delta.vector(), steps[i].increment.delta.vector()) << round;
    }
  }
}

TEST(StreamMerge, WithoutTheWindowLateSamplesAreLost) {
  Merge m;  // shows that the test above can fail
  field_core::Random random(7);
  for (const auto& [arrival, what] : arrivals(random, 60, 150, 0.5)) {
    if (what >= 0) m.merge.add_odometry(odom(0.1 * what, 0.0));
    if (what < 0) m.merge.add_sample(sample(0.033 * -what));
    m.ready();
  }
  EXPECT_GT(m.drops[DropReason::older_than_processed], 10);
}

}  // namespace
