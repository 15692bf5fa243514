// csv_to_bag from the command line: the bag's content, and what bad input gets.
#include <field_msgs/FieldMeasurement.h>
#include <geometry_msgs/PoseStamped.h>
#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <tf2_msgs/TFMessage.h>

#include <cmath>
#include <map>

#include "program_runner.hpp"

namespace field_bags {
namespace {

const char* const kOdometry = "stamp_s,x_m,y_m,yaw_rad\n10,0,0,0\n11,0.5,0,0.5\n12.5,1,0.25,-3.1\n";
const char* const kMeasurements = "stamp_s,light,ap1\n10.25,1.5,\n11,,\n12,2.25,-70\n";
const char* const kTruth = "stamp_s,x_m,y_m,yaw_rad\n10,3,4,1\n12.5,4,4,1.5\n";

class CsvToBag : public ::testing::Test {
 protected:
  ProgramResult convert(const std::string& more = "") {
    return run(std::string(CSV_TO_BAG) + " --odom " + (folder_ / "odom.csv") + " --measurements " +
               (folder_ / "m.csv") + " --output " + (folder_ / "out.bag") + " " + more);
  }
  void SetUp() override {
    folder_.write("odom.csv", kOdometry);
    folder_.write("m.csv", kMeasurements);
    folder_.write("truth.csv", kTruth);
  }
  /// Bad input: exit code 1, one line that holds all of `texts`, and no file beside the inputs.
  void expect_refused(const ProgramResult& result, const std::vector<std::string>& texts) {
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_EQ(result.error_lines(), 1) << result.err;
    for (const std::string& text : texts) {
      EXPECT_NE(result.err.find(text), std::string::npos) << text << " not in: " << result.err;
    }
    EXPECT_EQ(folder_.files(), 3u);
  }
  ScratchFolder folder_;
};

template <class Message>
std::vector<boost::shared_ptr<Message>> messages(const std::string& path, const char* topic) {
  rosbag::Bag bag(path);
  std::vector<boost::shared_ptr<Message>> found;
  for (const auto& m : rosbag::View(bag, rosbag::TopicQuery(topic))) {
    found.push_back(m.instantiate<Message>());
    EXPECT_TRUE(found.back() != nullptr) << topic << " has another type";
  }
  return found;
}

TEST_F(CsvToBag, CarriesEveryNumberOver) {
  const ProgramResult result = convert("--truth " + (folder_ / "truth.csv"));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto odometry = messages<nav_msgs::Odometry>(folder_ / "out.bag", "/odom");
  ASSERT_EQ(odometry.size(), 3u);
  EXPECT_EQ(odometry[2]->header.stamp, ros::Time(12, 500000000));
  EXPECT_EQ(odometry[2]->header.frame_id, "odom");
  EXPECT_EQ(odometry[2]->child_frame_id, "base_link");
  EXPECT_EQ(odometry[2]->pose.pose.position.x, 1.0);
  EXPECT_EQ(odometry[2]->pose.pose.position.y, 0.25);
  // Quaternions are rounded to 1e-9; near half a turn yaw = 2 atan2(z, w) moves by 2e-9 at most.
  const auto& q = odometry[2]->pose.pose.orientation;
  EXPECT_NEAR(2 * std::atan2(q.z, q.w), -3.1, 3e-9);
  const auto field = messages<field_msgs::FieldMeasurement>(folder_ / "out.bag", "/field");
  ASSERT_EQ(field.size(), 2u) << "the row without values is left out";
  EXPECT_EQ(field[0]->names, (std::vector<std::string>{"light", "ap1"}));
  EXPECT_EQ(field[0]->values[0], 1.5);
  EXPECT_TRUE(std::isnan(field[0]->values[1]));
  EXPECT_EQ(field[1]->values[1], -70.0);
  EXPECT_EQ(field[1]->header.frame_id, "base_link");
  EXPECT_TRUE(field[1]->variances.empty());
  const auto truth = messages<geometry_msgs::PoseStamped>(folder_ / "out.bag", "/ground_truth");
  ASSERT_EQ(truth.size(), 2u);
  EXPECT_EQ(truth[0]->header.frame_id, "map");
  EXPECT_EQ(truth[1]->pose.position.x, 4.0);
  const auto tf = messages<tf2_msgs::TFMessage>(folder_ / "out.bag", "/tf");
  ASSERT_EQ(tf.size(), 3u);
  EXPECT_EQ(tf[1]->transforms[0].header.frame_id, "odom");
  EXPECT_EQ(tf[1]->transforms[0].child_frame_id, "base_link");
  EXPECT_EQ(tf[1]->transforms[0].transform.translation.x, 0.5);
}

TEST_F(CsvToBag, RecordTimesAreTheStampsInOrder) {
  ASSERT_EQ(convert().exit_code, 0);
  rosbag::Bag bag(folder_ / "out.bag");
  std::vector<double> times;
  for (const auto& m : rosbag::View(bag)) times.push_back(m.getTime().toSec());
  EXPECT_EQ(times, (std::vector<double>{10, 10, 10.25, 11, 11, 12, 12.5, 12.5}));
}

TEST_F(CsvToBag, AcceptsAClockThatStartsAtZero) {
  folder_.write("odom.csv", "stamp_s,x_m,y_m,yaw_rad\n0,0,0,0\n1,1,0,0\n");
  folder_.write("m.csv", "stamp_s,a\n0,1\n1,2\n");
  const ProgramResult result = convert();
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(messages<nav_msgs::Odometry>(folder_ / "out.bag", "/odom")[0]->header.stamp,
            ros::Time(0));
}

TEST_F(CsvToBag, SameInputSameBytes) {
  ASSERT_EQ(convert().exit_code, 0);
  const std::string first = read_file(folder_ / "out.bag");
  ASSERT_EQ(convert().exit_code, 0);
  EXPECT_EQ(read_file(folder_ / "out.bag"), first);
}

TEST_F(CsvToBag, RefusesNaNNamingFileLineAndColumn) {
  folder_.write("m.csv", "stamp_s,light,ap1\n10,1,2\n11,nan,3\n");
  expect_refused(convert(), {"m.csv:3", "light", "nan"});
  folder_.write("m.csv", "stamp_s,light,ap1\n10,1,2\n11,1.5x,3\n");
  expect_refused(convert(), {"m.csv:3", "light", "1.5x"});
}

TEST_F(CsvToBag, RefusesStampsThatDoNotIncrease) {
  folder_.write("odom.csv", "stamp_s,x_m,y_m,yaw_rad\n1,0,0,0\n1,1,0,0\n");
  expect_refused(convert(), {"odom.csv:3", "stamp_s", "sort"});
  folder_.write("odom.csv", "stamp_s,x_m,y_m,yaw_rad\n-1,0,0,0\n1,1,0,0\n");
  expect_refused(convert(), {"odom.csv:2", "before 0", "shift"});
}

TEST_F(CsvToBag, SortsMeasurementsOnRequestAndJoinsRowsOfOneStamp) {
  folder_.write("m.csv", "stamp_s,light,ap1\n12,2.25,\n10.25,1.5,\n12,,-70\n11,3,-60\n");
  expect_refused(convert(), {"m.csv:3", "10.25", "--sort"});
  ASSERT_EQ(convert("--sort").exit_code, 0);
  const auto field = messages<field_msgs::FieldMeasurement>(folder_ / "out.bag", "/field");
  ASSERT_EQ(field.size(), 3u);
  EXPECT_EQ(field[0]->header.stamp, ros::Time(10, 250000000));
  EXPECT_EQ(field[1]->header.stamp, ros::Time(11));
  EXPECT_EQ(field[2]->header.stamp, ros::Time(12));
  EXPECT_EQ(field[2]->values, (std::vector<double>{2.25, -70}));
}

TEST_F(CsvToBag, SortingKeepsTheFirstOfTwoReadingsAndSaysSo) {
  folder_.write("m.csv", "stamp_s,light\n12,1\n11,1\n12,2\n");
  const ProgramResult result = convert("--sort");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("1 readings left out"), std::string::npos) << result.out;
  EXPECT_EQ(messages<field_msgs::FieldMeasurement>(folder_ / "out.bag", "/field")[1]->values[0], 1);
}

TEST_F(CsvToBag, PosesOutOfOrderAreNotSorted) {
  folder_.write("odom.csv", "stamp_s,x_m,y_m,yaw_rad\n2,0,0,0\n1,1,0,0\n");
  expect_refused(convert("--sort"), {"odom.csv:3", "sort"});
}

TEST_F(CsvToBag, RefusesMissingFilesAndColumns) {
  expect_refused(convert("--truth " + (folder_ / "none.csv")), {"none.csv"});
  folder_.write("odom.csv", "stamp_s,x_m,y_m\n1,0,0\n");
  expect_refused(convert(), {"odom.csv", "yaw_rad"});
}

TEST_F(CsvToBag, RefusesNothingMeasured) {
  folder_.write("m.csv", "stamp_s,light\n10,\n11,\n");
  expect_refused(convert(), {"m.csv", "no row has a value"});
  folder_.write("m.csv", "stamp_s\n10\n");
  expect_refused(convert(), {"m.csv", "one column per field"});
}

TEST_F(CsvToBag, RefusesAClockBeyondRosTime) {
  folder_.write("odom.csv", "stamp_s,x_m,y_m,yaw_rad\n5000000000,0,0,0\n");
  expect_refused(convert(), {"5000000000", "shift"});
}

TEST_F(CsvToBag, RefusesAFolderThatIsNotThere) {
  const ProgramResult result =
      run(std::string(CSV_TO_BAG) + " --odom " + (folder_ / "odom.csv") + " --measurements " +
          (folder_ / "m.csv") + " --output " + (folder_ / "no/such.bag"));
  expect_refused(result, {"no/such.bag", "folder"});
}

TEST_F(CsvToBag, CommandLineMisuseIsExitTwo) {
  EXPECT_EQ(run(CSV_TO_BAG).exit_code, 2);
  EXPECT_EQ(convert("--truht x").exit_code, 2);
  const ProgramResult help = run(std::string(CSV_TO_BAG) + " --help");
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_NE(help.out.find("--measurements"), std::string::npos);
}

}  // namespace
}  // namespace field_bags
