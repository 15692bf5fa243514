// States on disk: whole or not at all, refused with what differs, kept across the life of a
// process.
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <signal.h>
#include <std_msgs/Header.h>
#include <sys/wait.h>

#include <chrono>
#include <filesystem>
#include <random>
#include <thread>

#include "field_ros/services.hpp"
#include "field_ros/state_file.hpp"
#include "field_ros/state_keeper.hpp"
#include "test_support.hpp"
#include "toy_session.hpp"

namespace {

namespace fs = std::filesystem;
using namespace field_ros;
using field_ros_test::error_of;
using field_ros_test::make_session;
using field_ros_test::measurement;
using field_ros_test::odometry;

TEST(Session, StateFilesContinueTheRun) {
  const field_ros_test::TemporaryDirectory directory;
  const std::string keep = "state_directory: \"" + (directory / "states") + "\"\n";
  Session s = make_session(keep);
  s.on_odometry(odometry(1.0, 0.0));
  s.on_field(measurement(1.0, 3.0));
  EXPECT_TRUE(save_state(s, "lab-1").success);
  Session t = make_session(keep);
  t.on_odometry(odometry(1.0, 0.0));
  EXPECT_TRUE(load_state(t, "lab-1").success);
  for (Session* session : {&s, &t}) {
    session->on_odometry(odometry(2.0, 1.0));
    session->on_field(measurement(2.0, 5.0));
  }
  EXPECT_EQ(s.save_state().blocks, t.save_state().blocks);
  EXPECT_EQ(s.belief().covariance, t.belief().covariance);
  for (const char* name : {"", "../lab-1", "a/b", "a.bag", "a b"}) {
    EXPECT_FALSE(load_state(t, name).success) << name;
    EXPECT_FALSE(save_state(t, name).success) << name;
  }
  EXPECT_NE(std::string::npos, load_state(t, "other").message.find("No such file"));
  EXPECT_FALSE(save_state(make_session("state_directory: \"\"\n"), "a").success);
}

TEST(Session, ForeignAndDamagedStatesChangeNothing) {
  const field_ros_test::TemporaryDirectory directory;
  Session s = make_session("state_directory: \"" + (directory / "") + "\"\n");
  s.on_odometry(odometry(1.0, 0.0));
  s.on_field(measurement(1.0, 3.0));
  const auto before = s.save_state();
  auto foreign = before;
  foreign.estimator = "other";
  write_state_file(directory / "foreign.bag", foreign);
  EXPECT_NE(std::string::npos, load_state(s, "foreign").message.find("belongs to 'other'"));
  {
    rosbag::Bag bag(directory / "text.bag", rosbag::bagmode::Write);
    std_msgs::Header header;
    bag.write("/state", ros::Time(1.0), header);
  }
  EXPECT_NE(std::string::npos, load_state(s, "text").message.find("std_msgs/Header with md5sum"));
  write_state_file(directory / "cut.bag", before);
  std::filesystem::resize_file(directory / "cut.bag", 5000);
  EXPECT_FALSE(load_state(s, "cut").success);
  EXPECT_EQ(before.blocks, s.save_state().blocks);
  EXPECT_NE("", error_of([&] { write_state_file(directory / "no/such/place.bag", before); }));
}

// A state all of whose parts tell its number.
field_msgs::EstimatorState numbered(std::uint32_t number) {
  field_msgs::EstimatorState state;
  state.estimator = "toy";
  state.version = number;
  state.configuration = std::string(20000, static_cast<char>('a' + number % 26));
  field_msgs::NamedArray block;
  block.name = "field";
  block.shape = {30000};
  block.data.assign(30000, number);
  state.blocks = {block};
  return state;
}

// Writes states 1, 2, 3, ... over and over, until it is killed.
[[noreturn]] void write_for_ever(const std::string& path) {
  try {
    for (std::uint32_t number = 1;; ++number) write_state_file(path, numbered(number));
  } catch (...) {
    ::_exit(1);
  }
}

TEST(StateFile, KilledAtAnyMomentLeavesTheLastCompleteState) {
  const field_ros_test::TemporaryDirectory directory;
  const std::string path = directory / "state.bag";
  const auto begin_of_one = std::chrono::steady_clock::now();
  for (int i = 0; i < 5; ++i) write_state_file(path, numbered(0));
  // The moments fall into all phases of the first few writings, however slow the disk is.
  const std::chrono::duration<double, std::micro> one =
      (std::chrono::steady_clock::now() - begin_of_one) / 5;
  std::mt19937 random(1);
  std::uniform_int_distribution<int> microseconds(0, static_cast<int>(4.0 * one.count()));
  int interrupted = 0, newer = 0;
  for (int kill = 0; kill < 100; ++kill) {
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) write_for_ever(path);
    std::this_thread::sleep_for(std::chrono::microseconds(microseconds(random)));
    ::kill(child, SIGKILL);
    int status = 0;
    ::waitpid(child, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status)) << "the writer ended by itself";
    for (const auto& entry : fs::directory_iterator(directory / "")) {
      interrupted += entry.path().filename() != "state.bag";
    }
    const auto state = read_state_file(path);
    EXPECT_EQ(numbered(state.version), state) << "kill " << kill;
    newer += state.version > 0;
  }
  EXPECT_GT(interrupted, 10) << "hardly any kill came while the file was written";
  EXPECT_GT(newer, 10) << "hardly any state was ever completed";
  write_state_file(path, numbered(7));
  const auto begin = fs::directory_iterator(directory / "");
  EXPECT_EQ(1, std::distance(begin, fs::directory_iterator())) << "partial files are left";
}

TEST(Session, AStateOfAnotherConfigurationIsRefusedWithWhatDiffers) {
  const field_ros_test::TemporaryDirectory directory;
  const std::string keep = "state_directory: \"" + (directory / "") + "\"\n";
  ASSERT_TRUE(save_state(make_session(keep), "a").success);
  Session other = make_session(keep + "prior_stddev: 3\nregion: [0, 0, 1, 1]\n");
  const std::string text = load_state(other, "a").message;
  EXPECT_NE(std::string::npos, text.find("prior_stddev: 2 in the state, 3 here")) << text;
  EXPECT_NE(std::string::npos, text.find("region: [-1, -2, 3, 2] in the state, [0, 0, 1, 1] here"));
  EXPECT_EQ(std::string::npos, text.find("noise_stddev")) << text;
  // A default written down, the node's own parameters and where the robot starts do not matter.
  Session same =
      make_session(keep + "prior_stddev: 2.0\nmap_resolution: 2.0\nseed: 5\nstep_time: 0.001\n");
  EXPECT_TRUE(load_state(same, "a").success) << load_state(same, "a").message;
  auto moved = make_session(keep).save_state();
  moved.configuration = "noise_stddev: 0.5\ninitial_pose_x: -3.0\n";
  EXPECT_NO_THROW(same.restore(moved));
  moved.configuration = "noise_stddev: 0.5\nsmell: 1\n";
  EXPECT_NE(std::string::npos, error_of([&] { same.restore(moved); }).find("'smell'"));
}

TEST(ParamValues, DifferencesAreNamedUpToAFew) {
  const ParamValues a{{"p", "1"}, {"q", "2"}, {"initial_pose_x", "1"}, {"odom_alpha1", "0"}};
  EXPECT_EQ("", describe_differences(a, {{"p", "1"}, {"q", "2"}, {"initial_pose_x", "2"}}));
  EXPECT_EQ("q: 2 in the state, nothing here; r: nothing in the state, 3 here",
            describe_differences(a, {{"p", "1"}, {"r", "3"}}));
  EXPECT_EQ("", describe_differences({{"g/p", "1"}, {"h", "2"}}, {{"g/p", "2"}}, {"g", "h"}));
  ParamValues many;
  for (char c = 'a'; c < 'i'; ++c) many[std::string(1, c)] = "0";
  EXPECT_NE(std::string::npos, describe_differences(many, {}).find("; and 3 more"));
}

class Keeping : public ::testing::Test {
 protected:
  Session session(const std::string& extra) {
    return make_session("state_directory: \"" + (directory_ / "states") + "\"\n" + extra);
  }
  static void drive(Session& s, double start) {
    s.on_odometry(odometry(start, start));
    s.on_odometry(odometry(start + 1.0, start + 1.0));
    s.on_field(measurement(start + 1.0, 3.0));
  }
  static StateKeeper::Clock::time_point later(double seconds) {
    return StateKeeper::Clock::now() + std::chrono::milliseconds(static_cast<int>(1e3 * seconds));
  }
  std::string file(const std::string& name) const {
    return directory_ / ("states/" + name + ".bag");
  }
  field_ros_test::TemporaryDirectory directory_;
};

TEST_F(Keeping, SavesWhenThePeriodHasPassedAndSomethingWasLearned) {
  Session s = session("save_period: 10\n");
  StateKeeper keeper(s);
  keeper.tick(later(11.0));
  EXPECT_FALSE(fs::exists(directory_ / "states")) << "nothing was learned yet";
  drive(s, 1.0);
  keeper.tick(later(9.0));
  keeper.finish();  // the period has not passed, but this is the end
  EXPECT_EQ(1u, keeper.saved());
  EXPECT_EQ(s.save_state(), read_state_file(file("last")));
  drive(s, 10.0);
  keeper.tick(later(11.0));
  keeper.finish();  // waits for the saving, and has nothing to add
  EXPECT_EQ(2u, keeper.saved());
  EXPECT_EQ(s.save_state(), read_state_file(file("last")));
}

TEST_F(Keeping, ARestartedNodeResumesWithPoseAndMap) {
  const std::string config = "save_period: 10\nsave_name: robot1\nresume: true\n";
  Session first = session(config);
  StateKeeper keeper(first);
  drive(first, 1.0);
  keeper.finish();
  Session second = session(config);
  const StateKeeper restarted(second);
  EXPECT_EQ(first.belief().mean.x(), second.belief().mean.x());
  EXPECT_EQ(first.save_state().blocks, second.save_state().blocks);
  second.on_odometry(odometry(50.0, -7.0));
  EXPECT_NEAR(first.belief().mean.x() + 7.0, second.map_to_odom()->x(), 1e-12);
}

TEST_F(Keeping, StartsWithTheSurveyedMapAnywhereAndRefusesToStartWithLess) {
  Session survey = session("");
  drive(survey, 1.0);
  ASSERT_TRUE(save_state(survey, "site").success);
  const std::string config = "load_state: site\nstart_anywhere: true\nresume: true\n";
  Session s = session(config);
  const StateKeeper keeper(s);
  EXPECT_EQ(100.0, s.belief().covariance(0, 0)) << "the toy's scatter";
  EXPECT_EQ(predict_field(survey.estimator(), {}).names, predict_field(s.estimator(), {}).names);
  Session missing = session("load_state: nowhere\n");
  const std::string text = error_of([&] { const StateKeeper k(missing); });
  EXPECT_EQ(0u, text.find(file("nowhere"))) << text;
  Session other = session("load_state: site\nprior_stddev: 3\n");
  EXPECT_EQ(0u, error_of([&] { const StateKeeper k(other); }).find(file("site")));
  EXPECT_NE("", error_of([&] { session("load_state: a\nsave_name: a\n"); }));
}

TEST_F(Keeping, ASavingThatFailsIsReportedAndTriedAgain) {
  Session s = session("save_period: 10\n");
  StateKeeper keeper(s);
  drive(s, 1.0);
  field_ros_test::write_file(directory_ / "states", "a file is in the way");
  keeper.finish();
  EXPECT_NE(std::string::npos, keeper.problem().find("states: cannot be made a directory"));
  fs::remove(directory_ / "states");
  keeper.finish();
  EXPECT_EQ("", keeper.problem());
  EXPECT_EQ(s.save_state(), read_state_file(file("last")));
}

}  // namespace
