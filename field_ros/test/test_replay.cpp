// The offline program: its files, its determinism, and how it refuses.
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <sensor_msgs/Illuminance.h>
#include <tf2_msgs/TFMessage.h>

#include "field_core/csv.hpp"
#include "field_ros/map_files.hpp"
#include "field_ros/replay.hpp"
#include "test_support.hpp"
#include "toy_estimator.hpp"

namespace {

using namespace field_ros;
using field_ros_test::error_of;
using field_ros_test::measurement;
using field_ros_test::odometry;
using field_ros_test::read_file;
using field_ros_test::ToyEstimator;
using field_ros_test::write_file;

class Replay : public ::testing::Test {
 protected:
  void SetUp() override {
    write_file(directory_ / "config.yaml", "noise_stddev: 0.5\nmap_resolution: 1.0\n");
    write_bag(directory_ / "run.bag");
    options_.bag = directory_ / "run.bag";
    options_.config = directory_ / "config.yaml";
    options_.output = directory_ / "out";
  }

  // 1 m/s along x for 10 s; light 3.0 each second, from a sensor 0.5 m to the left.
  static void write_bag(const std::string& path) {
    rosbag::Bag bag(path, rosbag::bagmode::Write);
    tf2_msgs::TFMessage tf;
    tf.transforms.resize(1);
    tf.transforms[0].header.frame_id = "base_link";
    tf.transforms[0].child_frame_id = "lamp";
    tf.transforms[0].transform = to_transform({0.0, 0.5, 0.0});
    bag.write("/tf_static", ros::Time(100.0), tf);
    for (int i = 0; i <= 100; ++i) {
      const double t = 100.0 + 0.1 * i;
      bag.write("/odom", ros::Time(t), odometry(t, 0.1 * i));
      if (i % 10 != 5) continue;
      auto m = measurement(t, 3.0);
      m.header.frame_id = "lamp";
      bag.write("/field", ros::Time(t), m);
      sensor_msgs::Illuminance lux;
      lux.header = m.header;
      lux.illuminance = 4.0;
      bag.write("/lux", ros::Time(t), lux);
    }
  }

  void run() { replay(estimator_entry<ToyEstimator>(), options_); }
  std::string refusal() {
    return error_of([this] { run(); });
  }
  int main_with(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "toy_replay");
    std::vector<char*> argv;
    for (auto& a : arguments) argv.push_back(a.data());
    return run_replay<ToyEstimator>(static_cast<int>(argv.size()), argv.data());
  }

  field_ros_test::TemporaryDirectory directory_;
  ReplayOptions options_;
};

TEST_F(Replay, WritesAllFiles) {
  write_file(directory_ / "points.csv", "x_m,y_m\n0.5,1\n");
  options_.predict = directory_ / "points.csv";
  run();
  const auto estimate = field_core::CsvTable::read(directory_ / "out/estimate.csv");
  ASSERT_EQ(10u, estimate.rows());
  EXPECT_NEAR(9.5, estimate.number(9, estimate.column("x_m")), 1e-9);
  EXPECT_NEAR(109.5, estimate.number(9, estimate.column("stamp_s")), 1e-6);
  EXPECT_NEAR(0.5, ToyEstimator::last_place_.y(), 1e-9);
  // 10 readings of 3.0 with variance 0.25 against the prior N(0, 4).
  const double precision = 1.0 / 4.0 + 10.0 / 0.25, mean = 10.0 * 3.0 / 0.25 / precision;
  const auto prediction = field_core::CsvTable::read(directory_ / "out/prediction.csv");
  ASSERT_EQ(1u, prediction.rows());
  EXPECT_EQ("light", prediction.text(0, prediction.column("field")));
  EXPECT_NEAR(mean, prediction.number(0, prediction.column("mean")), 1e-12);
  EXPECT_NEAR(1.0 / precision + 0.25, prediction.number(0, prediction.column("variance")), 1e-12);
  const auto field = field_core::CsvTable::read(directory_ / "out/field_light.csv");
  ASSERT_EQ(16u, field.rows());  // 4 m x 4 m
  EXPECT_EQ(-0.5, field.number(0, field.column("x_m")));
  EXPECT_EQ(-1.5, field.number(0, field.column("y_m")));
  EXPECT_EQ(10u, field_core::CsvTable::read(directory_ / "out/timing.csv").rows());
  const std::string summary = read_file(directory_ / "out/summary.json");
  for (const char* part : {"\"estimator\": \"toy\"", "\"steps\": 10", "\"applied\": 10",
                           "\"seed\": 1", "\"duration_s\": 10,"}) {
    EXPECT_NE(std::string::npos, summary.find(part)) << part << summary;
  }
}

TEST_F(Replay, TwoRunsWriteTheSameBytesAndReplaceOldFiles) {
  run();
  options_.output = directory_ / "again";
  std::filesystem::create_directory(options_.output);
  write_file(directory_ / "again/estimate.csv", "old");
  run();
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(directory_ / "again")) {
    ++files;
    const std::string name = entry.path().filename();
    if (name == "timing.csv") continue;
    EXPECT_EQ(read_file(directory_ / ("out/" + name)), read_file(entry.path())) << name;
  }
  EXPECT_EQ(5, files);  // and no temporary one
}

TEST_F(Replay, StandardSensorsNeedNoConverter) {
  write_file(options_.config,
             "noise_stddev: 0.5\nsensors: {l: {type: illuminance, topic: lux, field: light}}\n");
  options_.field_topic = "/unused";
  run();
  EXPECT_NE(std::string::npos, read_file(directory_ / "out/summary.json").find("\"applied\": 10"));
}

TEST_F(Replay, ContinuesFromAState) {
  options_.save_state = directory_ / "state.bag";
  run();
  options_.load_state = options_.save_state;
  options_.save_state.clear();
  options_.output = directory_ / "second";
  run();
  const auto estimate = field_core::CsvTable::read(directory_ / "second/estimate.csv");
  EXPECT_NEAR(9.5 + 9.5, estimate.number(9, estimate.column("x_m")), 1e-9);
}

TEST_F(Replay, RefusesBadInputWithOneLineAndWritesNothing) {
  const auto expect = [this](const std::string& part) {
    const std::string text = refusal();
    EXPECT_NE(std::string::npos, text.find(part)) << text;
    EXPECT_EQ(std::string::npos, text.find('\n')) << text;
    EXPECT_FALSE(std::filesystem::exists(options_.output)) << part;
  };
  const ReplayOptions good = options_;
  options_.bag = directory_ / "missing.bag";
  expect("missing.bag: cannot be read: No such file");
  options_.bag = good.config;
  expect("is not a bag");
  options_ = good, options_.odom_topic = "/wheels";
  expect("there is no topic '/wheels'; topics of type nav_msgs/Odometry in this bag: /odom");
  options_ = good, options_.field_topic = "/odom";
  expect(
      "topic '/odom' is nav_msgs/Odometry; topics of type field_msgs/FieldMeasurement in this bag: "
      "/field");
  options_ = good, options_.config = directory_ / "none.yaml";
  expect("none.yaml: cannot be read");
  write_file(directory_ / "bad.yaml", "noise_stdev: 1\n");
  options_.config = directory_ / "bad.yaml";
  expect("bad.yaml:1: parameter 'noise_stdev': is unknown; did you mean 'noise_stddev'?");
  write_file(directory_ / "other.yaml", "noise_stddev: 1\nfield: smell\n");
  options_.config = directory_ / "other.yaml";
  expect("no measurement could be used (dropped: 10 no_known_field)");
  options_ = good, options_.predict = directory_ / "none.csv";
  expect("none.csv");
  options_ = good, options_.load_state = good.bag;
  expect("holds no /state");
  options_ = good, options_.save_state = directory_ / "no/such/state.bag";
  expect("its directory does not exist");
  options_ = good, options_.output = good.bag + "/x";
  EXPECT_NE("", refusal());
}

TEST_F(Replay, RefusesCutAndEmptyBags) {
  const std::string whole = read_file(options_.bag);
  for (const std::size_t size :
       {std::size_t{100}, std::size_t{5000}, whole.size() / 2, whole.size() - 10}) {
    write_file(directory_ / "cut.bag", whole.substr(0, size));
    options_.bag = directory_ / "cut.bag";
    const std::string text = refusal();
    EXPECT_NE(std::string::npos, text.find("rosbag reindex")) << size << ": " << text;
    EXPECT_FALSE(std::filesystem::exists(options_.output));
  }
  { rosbag::Bag empty(directory_ / "empty.bag", rosbag::bagmode::Write); }
  options_.bag = directory_ / "empty.bag";
  EXPECT_NE(std::string::npos, refusal().find("holds no message"));
}

TEST_F(Replay, ExitCodes) {
  const std::string bag = options_.bag, config = options_.config, out = options_.output;
  EXPECT_EQ(0, main_with({"--help"}));
  EXPECT_EQ(0, main_with({"--print-config"}));
  EXPECT_EQ(0, main_with({"--bag", bag, "--config", config, "--output", out}));
  EXPECT_EQ(2, main_with({"--bag", bag, "--config", config}));
  EXPECT_EQ(2, main_with({"--nonsense"}));
  EXPECT_EQ(2, main_with({"--bag", bag, "--config", config, "--output", out, "--seed", "many"}));
  EXPECT_EQ(1, main_with({"--bag", bag + "x", "--config", config, "--output", out}));
}

TEST_F(Replay, TheMapsOfAStateNeedNoBag) {
  options_.save_state = directory_ / "state.bag";
  options_.export_maps = true;
  run();
  const std::string csv = read_file(directory_ / "out/field_light.csv");
  const std::string pgm = read_file(directory_ / "out/field_light.pgm");
  ASSERT_EQ("P5\n4 4\n255\n", pgm.substr(0, 11));
  options_ = ReplayOptions();
  options_.config = directory_ / "config.yaml";
  options_.output = directory_ / "maps";
  options_.load_state = directory_ / "state.bag";
  options_.export_maps = true;
  run();
  EXPECT_EQ(csv, read_file(directory_ / "maps/field_light.csv"));
  EXPECT_EQ(pgm, read_file(directory_ / "maps/field_light.pgm"));
  EXPECT_FALSE(std::filesystem::exists(directory_ / "maps/estimate.csv"));
  EXPECT_EQ(2, main_with({"--config", options_.config, "--output", options_.output}));
  EXPECT_EQ(2, main_with({"--config", options_.config, "--output", options_.output, "--load-state",
                          options_.load_state, "--save-state", directory_ / "b.bag"}));
}

TEST(MapFiles, BeginAtTheTopAndSayWhatIsNotKnown) {
  PredictedGrid map;
  map.grid = {-1.0, 2.0, 0.5, 2, 2};
  map.fields = {{"light", "lx"}};
  map.prediction.mean = Eigen::RowVector4d(-3.0, 5.0, 1.0, -1.0);
  map.prediction.variance = Eigen::RowVector4d(1.0, 3.9, 1.0, 2.25);
  map.prediction.prior_variance = Eigen::VectorXd::Constant(1, 4.0);
  const auto files = map_files(map);
  ASSERT_EQ(6u, files.size());
  EXPECT_EQ(std::string("P5\n2 2\n255\n") + static_cast<char>(100) + static_cast<char>(50) +
                std::string("\0\xff", 2),
            files.at("field_light.pgm"));
  EXPECT_EQ(
      "ncols 2\nnrows 2\nxllcorner -1\nyllcorner 2\ncellsize 0.5\nNODATA_value -9999\n1 -1\n-3 "
      "-9999\n",
      files.at("field_light.asc"));
  const std::string& yaml = files.at("field_light.yaml");
  EXPECT_EQ(0u, yaml.find("# light: pixel 0 is -3 lx, 100 is 1 lx")) << yaml;
  EXPECT_NE(std::string::npos, yaml.find("\norigin: [-1, 2, 0.0]\n"));
  EXPECT_NE(std::string::npos, files.at("field_light_stddev.asc").find("\n1 1.5\n1 -9999\n"));
}

}  // namespace
