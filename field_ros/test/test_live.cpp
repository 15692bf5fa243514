// What a live node adds to a replay: waiting for tf, shedding, the verdict "lost", diagnostics, and
// parameters that change.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "field_core/random.hpp"
#include "field_ros/diagnostics.hpp"
#include "field_ros/lost_monitor.hpp"
#include "field_ros/placement_queue.hpp"
#include "field_ros/reconfigure.hpp"
#include "test_support.hpp"
#include "toy_session.hpp"

namespace {

using namespace field_ros;
using diagnostic_msgs::DiagnosticStatus;
using field_core::SE2;
using field_core::Stamp;
using field_core::stamp_from_seconds;
using field_ros_test::error_of;
using field_ros_test::make_session;
using field_ros_test::measurement;
using field_ros_test::odometry;

class Placement : public ::testing::Test {
 protected:
  Placement()
      : queue_([this](const std::string& frame, Stamp) { return place(frame); },
               stamp_from_seconds(10.0), 5,
               [this](DropReason reason) { drops_.push_back(reason); }) {}
  std::optional<SE2> place(const std::string& frame) const {
    return known_.count(frame) ? std::optional<SE2>(SE2(1.0, 0.0, 0.0)) : std::nullopt;
  }
  void add(double stamp_s, const std::string& frame) {
    field_core::Sample sample;
    sample.stamp = stamp_from_seconds(stamp_s);
    queue_.add(sample, frame);
  }
  /// Stamps of all that is placed when odometry has come to `now_s`.
  std::vector<double> take(double now_s) {
    std::vector<double> stamps;
    while (const auto sample = queue_.next(stamp_from_seconds(now_s))) {
      stamps.push_back(field_core::to_seconds(sample->stamp));
    }
    return stamps;
  }
  std::set<std::string> known_;
  std::vector<DropReason> drops_;
  PlacementQueue queue_;
};

TEST_F(Placement, MeasurementsBeforeTheStaticTransformAreKeptInOrder) {
  add(1.0, "mast");
  add(2.0, "");
  add(3.0, "mast");
  EXPECT_EQ(std::vector<double>(), take(5.0));
  known_.insert("mast");
  EXPECT_EQ((std::vector<double>{1.0, 2.0, 3.0}), take(5.0));
  EXPECT_TRUE(drops_.empty());
}

TEST_F(Placement, AFrameThatNeverComesIsGivenUpOnceAndHoldsUpNothingAfterwards) {
  add(1.0, "nowhere");
  add(2.0, "");
  EXPECT_EQ(std::vector<double>(), take(10.9));
  EXPECT_EQ((std::vector<double>{2.0}), take(11.0));
  add(12.0, "nowhere");
  add(13.0, "");
  EXPECT_EQ((std::vector<double>{13.0}), take(13.0));
  EXPECT_EQ((std::vector<DropReason>(2, DropReason::unknown_frame)), drops_);
  known_.insert("nowhere");
  add(14.0, "nowhere");
  EXPECT_EQ((std::vector<double>{14.0}), take(14.0));
}

TEST_F(Placement, WaitingIsBounded) {
  for (int i = 0; i < 8; ++i) add(i, "nowhere");
  EXPECT_EQ(5u, queue_.size());
  EXPECT_EQ(std::vector<DropReason>(3, DropReason::queue_full), drops_);
  EXPECT_FALSE(queue_.next_at_end());
  EXPECT_EQ(0u, queue_.size());
}

TEST(Overload, OldMeasurementsAreShedAndThePoseStaysWithinTheLag) {
  Session s = make_session("max_pose_lag: 0.5\n");
  s.defer_steps();
  for (int i = 0; i <= 40; ++i) s.on_odometry(odometry(1.0 + 0.1 * i, 0.1 * i));
  for (int i = 0; i <= 40; ++i) s.on_field(measurement(1.0 + 0.1 * i, 3.0));
  EXPECT_EQ(0u, s.counts().steps) << "deferred";
  ASSERT_TRUE(s.step_next());
  EXPECT_NEAR(4.5, field_core::to_seconds(s.belief().stamp), 1e-9);
  EXPECT_EQ((Counts{{"shed", 35}}), s.counts().dropped);
  while (s.step_next()) {
  }
  EXPECT_EQ(6u, s.counts().steps) << "within the lag none is shed";
  EXPECT_NEAR(14.0, s.belief().mean.x(), 1e-12) << "the motion of what was shed is not lost";
}

TEST(Overload, WithoutALimitAndInAReplayNothingIsShed) {
  Session live = make_session("max_pose_lag: 0\n"), replay = make_session();
  live.defer_steps();
  for (Session* s : {&live, &replay}) {
    for (int i = 0; i <= 40; ++i) s->on_field(measurement(1.0 + 0.1 * i, 3.0));
    for (int i = 0; i <= 40; ++i) s->on_odometry(odometry(1.0 + 0.1 * i, 0.1 * i));
  }
  while (live.step_next()) {
  }
  EXPECT_EQ(41u, live.counts().applied);
  EXPECT_EQ(live.save_state().blocks, replay.save_state().blocks);
}

TEST(Overload, AClockThatEndsTakesItsReadyStepsAlong) {
  Session s = make_session();
  s.defer_steps();
  int steps = 0;
  s.set_listener([&steps](const SessionStep&) { ++steps; });
  for (const double t : {100.0, 101.0}) s.on_odometry(odometry(t, t));
  s.on_field(measurement(100.5, 3.0));
  for (const double t : {1.0, 2.0}) s.on_odometry(odometry(t, 50.0));
  EXPECT_EQ(1, steps);
  EXPECT_EQ(1u, s.counts().clock_resets);
}

// Independent of the monitor: chi-square draws as sums of squared normals.
double chi_square(field_core::Random& random, int dof) {
  double sum = 0.0;
  for (int i = 0; i < dof; ++i) sum += std::pow(random.normal(), 2);
  return sum;
}

TEST(Lost, AConsistentFilterIsHardlyEverCalledLostAndAKidnappedOneSoon) {
  field_core::Random random(3);
  LostMonitor monitor(20);
  int lost = 0;
  for (int i = 0; i < 20000; ++i) {
    monitor.add({true, "", chi_square(random, 3), 3}, 2.6);
    lost += monitor.lost();
  }
  // 60 degrees of freedom exceed 2.6 times their number with a probability of 1e-10.
  EXPECT_EQ(0, lost);
  EXPECT_NEAR(1.0, monitor.ratio(), 0.6);  // 3.3 standard deviations of chi-square(60) / 60
  int until = 0;
  while (!monitor.lost() && until < 100) {
    monitor.add({true, "", 9.0 * chi_square(random, 3), 3}, 2.6);
    ++until;
  }
  EXPECT_GE(until, 2);
  EXPECT_LE(until, 12);
  monitor.clear();
  EXPECT_FALSE(monitor.lost());
  monitor.add({true, "", 1e6, 1}, 2.6);
  EXPECT_FALSE(monitor.lost()) << "one outlier is no full window";
  monitor.add(field_core::UpdateResult::skipped("x"), 2.6);
  EXPECT_EQ(1e6, monitor.ratio());
}

TEST(Lost, TheVerdictOfASessionAndItsRecovery) {
  for (const bool recovery : {false, true}) {
    Session s =
        make_session(std::string("lost_window: 5\nrecovery: ") + (recovery ? "true\n" : "false\n"));
    s.on_odometry(odometry(1.0, 0.0));
    double t = 1.0;
    const auto measure = [&](double value, int times) {
      for (int i = 0; i < times; ++i) {
        t += 1.0;
        s.on_odometry(odometry(t, 0.0));
        s.on_field(measurement(t, value));
      }
    };
    measure(3.0, 20);
    EXPECT_FALSE(s.health().lost);
    measure(30.0, 5);
    EXPECT_EQ(!recovery, s.health().lost);
    EXPECT_EQ(recovery ? 1u : 0u, s.counts().recoveries);
    EXPECT_EQ(recovery, s.belief().covariance(0, 0) >= 100.0);
    measure(s.recent_nis() >= 0.0 ? 15.0 : 0.0, 1);
    geometry_msgs::PoseWithCovarianceStamped guess;
    guess.pose.pose.orientation.w = 1.0;
    s.on_initialpose(guess);
    EXPECT_FALSE(s.health().lost) << "the pose is another one";
  }
}

TEST(Diagnostics, SayWhatIsWrong) {
  HealthSnapshot before, now;
  now.time_s = 2.0;
  now.counts.odometry = 20;
  now.counts.measurements = 2;
  now.counts.dropped["duplicate_field"] = 1;
  auto array = diagnose("node", before, now);
  EXPECT_EQ(diagnostic_msgs::DiagnosticStatus::WARN, array.status[0].level);
  EXPECT_EQ(0u, array.status[0].message.find("dropped: duplicate_field"));
  EXPECT_EQ("10", array.status[0].values[0].value);
  EXPECT_EQ(diagnostic_msgs::DiagnosticStatus::OK, array.status[1].level);
  before = now;
  now.counts.odometry = now.counts.measurements = 30;  // the old drop is no news
  now.counts.numerical_errors = 1;
  now.last_error = "went dark";
  array = diagnose("node", before, now);
  EXPECT_EQ(diagnostic_msgs::DiagnosticStatus::OK, array.status[0].level);
  EXPECT_EQ(diagnostic_msgs::DiagnosticStatus::ERROR, array.status[1].level);
  EXPECT_EQ("went dark", array.status[1].message);
  before = now;
  now.counts.nis_dof_sum = 100;
  now.counts.nis_sum = 500.0;
  array = diagnose("node", before, now);
  EXPECT_EQ(diagnostic_msgs::DiagnosticStatus::WARN, array.status[1].level);
}

// Level and beginning of the text, of input (0) or estimator (1).
testing::AssertionResult says(const HealthSnapshot& now, int index, int level,
                              const std::string& beginning, HealthSnapshot before = {}) {
  const auto status = diagnose("node", before, now).status.at(static_cast<std::size_t>(index));
  if (status.level == level && status.message.rfind(beginning, 0) == 0) {
    return testing::AssertionSuccess();
  }
  return testing::AssertionFailure() << int{status.level} << ": " << status.message;
}

TEST(Diagnostics, EveryLevelOfTheInput) {
  HealthSnapshot now;
  now.time_s = 1.0;
  EXPECT_TRUE(says(now, 0, DiagnosticStatus::WARN, "no odometry yet"));
  now.counts.odometry = 10;
  EXPECT_TRUE(says(now, 0, DiagnosticStatus::WARN, "no measurement yet"));
  now.counts.measurements = 1;
  now.since_measurement_s = 4.0;  // a WiFi scan takes its time
  EXPECT_TRUE(says(now, 0, DiagnosticStatus::OK, "OK"));
  now.since_measurement_s = 6.0;
  EXPECT_TRUE(says(now, 0, DiagnosticStatus::STALE, "no measurement for 6 s"));
  now.since_odometry_s = 7.0;
  EXPECT_TRUE(says(now, 0, DiagnosticStatus::STALE, "no odometry for 7 s"));
  now.since_measurement_s = now.since_odometry_s = 0.0;
  now.counts.dropped = {{"no_known_field", 9}, {"shed", 1}};
  EXPECT_TRUE(says(now, 0, DiagnosticStatus::WARN, "dropped: no_known_field"));
  EXPECT_TRUE(says(now, 0, DiagnosticStatus::OK, "OK", now)) << "old drops are no news";
  now.since_step_s = 6.0;
  EXPECT_TRUE(says(now, 0, DiagnosticStatus::ERROR, "no measurement could be used for 6 s"));
  now.counts.dropped = {{"paused", 3}};
  now.paused = true;
  EXPECT_TRUE(says(now, 0, DiagnosticStatus::OK, "OK"));
  now = HealthSnapshot();
  now.counts.odometry = now.counts.measurements = 1;
  now.waiting_for_transform = 1;
  now.since_step_s = 2.0;
  EXPECT_TRUE(says(now, 0, DiagnosticStatus::WARN, "measurements wait for the transform"));
}

TEST(Diagnostics, EveryLevelOfTheEstimator) {
  HealthSnapshot now;
  EXPECT_TRUE(says(now, 1, DiagnosticStatus::OK, "OK"));
  now.save_problem = "disk full";
  EXPECT_TRUE(says(now, 1, DiagnosticStatus::WARN, "the state is not saved: disk full"));
  now.health = {true, "kidnapped"};
  EXPECT_TRUE(says(now, 1, DiagnosticStatus::ERROR, "lost: kidnapped"));
  now.since_step_s = 8.0;
  EXPECT_TRUE(says(now, 1, DiagnosticStatus::STALE, "no measurement used for 8 s"));
  now = HealthSnapshot();
  now.paused = true;
  now.since_step_s = 8.0;
  EXPECT_TRUE(says(now, 1, DiagnosticStatus::OK, "paused"));
}

TEST(Reconfigure, TheProtocolFollowsFromTheDeclaration) {
  RuntimeParams params;
  params.transform_tolerance = 0.3;
  const auto description = describe(params);
  ASSERT_EQ(1u, description.groups.size());
  EXPECT_EQ(description.dflt.bools.size() + description.dflt.ints.size() +
                description.dflt.doubles.size(),
            description.groups[0].parameters.size());
  EXPECT_EQ("tf_broadcast", description.groups[0].parameters[0].name);
  EXPECT_EQ("bool", description.groups[0].parameters[0].type);
  EXPECT_EQ(description.dflt.doubles.size(), description.max.doubles.size());
  EXPECT_EQ(0.3, to_config(params).doubles.at(0).value);
  EXPECT_EQ(0.1, description.dflt.doubles.at(0).value);
}

TEST(Reconfigure, ChangesAreCheckedAsStrictlyAsAtTheStart) {
  const auto with = [](const std::string& name, double value) {
    dynamic_reconfigure::Config config;
    config.doubles.resize(1);
    config.doubles[0].name = name;
    config.doubles[0].value = value;
    return config;
  };
  EXPECT_EQ(0.5, changed({}, with("transform_tolerance", 0.5)).transform_tolerance);
  EXPECT_EQ("parameter 'transform_tolerance': -1 is not allowed; it must be >= 0",
            error_of([&] { changed({}, with("transform_tolerance", -1.0)); }));
  EXPECT_NE("", error_of([&] { changed({}, with("transform_tolerance", NAN)); }));
  EXPECT_EQ("parameter 'lost_nos': is unknown; did you mean 'lost_nis'?",
            error_of([&] { changed({}, with("lost_nos", 1.0)); }));
  EXPECT_EQ("parameter 'recovery': has another type",
            error_of([&] { changed({}, with("recovery", 1.0)); }));
  EXPECT_NE(std::string::npos, error_of([&] {
                                 changed({}, with("particles", 1.0));
                               }).find("cannot be changed while the node runs"));
}

}  // namespace
