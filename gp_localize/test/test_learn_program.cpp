// The program learn_hyperparameters: what it writes is a configuration, from CSV and bag alike.
#include <field_msgs/FieldMeasurement.h>
#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>
#include <stdlib.h>
#include <sys/wait.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "field_core/random.hpp"
#include "field_ros/convert.hpp"
#include "field_ros/node_params.hpp"
#include "field_ros/param_loader.hpp"
#include "gp_localize/gp_localize.hpp"

namespace {

class LearnProgram : public ::testing::Test {
 protected:
  LearnProgram() {
    std::string name = (std::filesystem::temp_directory_path() / "learn.XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
  }
  ~LearnProgram() override { std::filesystem::remove_all(folder_); }

  std::string file(const std::string& name) const { return folder_ + "/" + name; }

  int run(const std::string& arguments) {
    const std::string command = std::string(LEARN_HYPERPARAMETERS) + " " + arguments + " > '" +
                                file("out") + "' 2> '" + file("err") + "'";
    return WEXITSTATUS(std::system(command.c_str()));
  }
  std::string text(const std::string& name) const {
    std::ostringstream text;
    text << std::ifstream(file(name)).rdbuf();
    return text.str();
  }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(file(name)) << text;
  }

  std::string folder_;
};

double light(double x, double y) { return 5.0 + 2.0 * std::sin(0.7 * x) * std::cos(0.5 * y); }

std::string survey(int rows) {
  field_core::Random random(1);
  std::ostringstream csv;
  csv << "x_m,y_m,light,heat\n";
  for (int i = 0; i < rows; ++i) {
    const double x = random.uniform(0.0, 8.0), y = random.uniform(0.0, 8.0);
    csv << x << "," << y << "," << light(x, y) + 0.1 * random.normal() << ",";
    if (i % 2 == 0) csv << 20.0 + 0.3 * x + 0.05 * random.normal();
    csv << "\n";
  }
  return csv.str();
}

TEST_F(LearnProgram, WritesFieldsThatTheFilterTakes) {
  write("survey.csv", survey(80));
  ASSERT_EQ(0, run("--survey " + file("survey.csv") + " --output " + file("hyper.yaml") +
                   " --unit light lx --starts 2"))
      << text("err");
  const auto tree = field_ros::ParamTree::from_yaml_file(file("hyper.yaml"));
  gp_localize::GpLocalizeParams params;
  field_ros::NodeParams node;
  field_ros::load_params(tree, node, params);
  ASSERT_EQ(2u, params.fields.size());
  const auto& field = params.fields.at("light");
  EXPECT_EQ("lx", field.unit);
  // 80 measurements with 0.1 of noise: its standard error is 0.01.
  EXPECT_NEAR(field.noise_stddev, 0.1, 0.04);
  EXPECT_NEAR(field.mean, 5.0, 3.0);
  EXPECT_GT(params.fields.at("heat").length_scales[0], 3.0);
  EXPECT_NO_THROW(gp_localize::GpLocalize(params, 1));
}

TEST_F(LearnProgram, WritesAGroupThatTheFilterTakes) {
  field_core::Random random(3);
  std::ostringstream csv;
  csv << "x_m,y_m,light,heat\n";
  for (int i = 0; i < 60; ++i) {  // heat falls where light rises
    const double x = random.uniform(0.0, 8.0), y = random.uniform(0.0, 8.0);
    csv << x << "," << y << "," << light(x, y) + 0.1 * random.normal() << ","
        << 20.0 - 0.5 * light(x, y) + 0.1 * random.normal() << "\n";
  }
  write("survey.csv", csv.str());
  ASSERT_EQ(0, run("--survey " + file("survey.csv") + " --output " + file("hyper.yaml") +
                   " --coregionalize room=light,heat --starts 2"))
      << text("err");
  gp_localize::GpLocalizeParams params;
  field_ros::NodeParams node;
  field_ros::load_params(field_ros::ParamTree::from_yaml_file(file("hyper.yaml")), node, params);
  ASSERT_EQ(1u, params.coregionalization.count("room"));
  const auto& room = params.coregionalization.at("room");
  EXPECT_EQ(room.fields, (std::vector<std::string>{"light", "heat"}));
  ASSERT_EQ(room.correlations.size(), 1u);
  EXPECT_LT(room.correlations[0], -0.9);
  EXPECT_GE(room.correlations[0], -1.0);
  EXPECT_EQ(params.fields.at("light").length_scales, params.fields.at("heat").length_scales);
  EXPECT_NO_THROW(gp_localize::GpLocalize(params, 1));
}

TEST_F(LearnProgram, SaysWhatAGroupIs) {
  write("survey.csv", survey(20));
  for (const char* group : {"room", "room=light", "room=light,light", "=light,heat"}) {
    EXPECT_NE(0, run("--survey " + file("survey.csv") + " --output " + file("hyper.yaml") +
                     " --coregionalize " + group));
    EXPECT_NE(text("err").find("NAME=FIELD,FIELD"), std::string::npos) << group << text("err");
  }
  EXPECT_NE(0, run("--survey " + file("survey.csv") + " --output " + file("hyper.yaml") +
                   " --coregionalize room=light,gas"));
  EXPECT_NE(text("err").find("gas"), std::string::npos) << text("err");
  EXPECT_FALSE(std::filesystem::exists(file("hyper.yaml")));
}

TEST_F(LearnProgram, ReadsABagWithTruth) {
  {
    rosbag::Bag bag(file("run.bag"), rosbag::bagmode::Write);
    field_core::Random random(2);
    for (int i = 0; i < 150; ++i) {
      const ros::Time time(10.0 + i);
      nav_msgs::Odometry truth;
      truth.header.stamp = time;
      const field_core::SE2 pose(4.0 + 3.5 * std::cos(0.21 * i), 4.0 + 3.5 * std::sin(0.13 * i),
                                 0.0);
      truth.pose.pose = field_ros::to_pose(pose);
      bag.write("/ground_truth", time, truth);
      field_msgs::FieldMeasurement m;
      m.header.stamp = time;
      m.header.frame_id = "base_link";
      m.names = {"light", "never"};
      m.values = {light(pose.x(), pose.y()) + 0.1 * random.normal(), NAN};
      bag.write("/field", time, m);
    }
  }
  ASSERT_EQ(0, run("--bag " + file("run.bag") + " --output " + file("hyper.yaml") +
                   " --starts 2 --kernel best"))
      << text("err");
  gp_localize::GpLocalizeParams params;
  field_ros::NodeParams node;
  field_ros::load_params(field_ros::ParamTree::from_yaml_file(file("hyper.yaml")), node, params);
  ASSERT_EQ(1u, params.fields.size());
  EXPECT_NEAR(params.fields.at("light").noise_stddev, 0.1, 0.03);  // +- 0.007
  EXPECT_NE(std::string::npos, text("hyper.yaml").find("of 6 starts agree"));

  EXPECT_EQ(1,
            run("--bag " + file("run.bag") + " --truth-topic /none --output " + file("no.yaml")));
  EXPECT_NE(std::string::npos, text("err").find("/none"));
  EXPECT_FALSE(std::filesystem::exists(file("no.yaml")));
}

TEST_F(LearnProgram, SaysWhatIsWrong) {
  EXPECT_EQ(0, run("--help"));
  EXPECT_EQ(2, run("--output " + file("a.yaml")));
  EXPECT_EQ(2, run("--survey a.csv --bag b.bag --output " + file("a.yaml")));
  EXPECT_EQ(2, run("--survey a.csv --kernel linear --output " + file("a.yaml")));
  write("few.csv", survey(5));
  EXPECT_EQ(1, run("--survey " + file("few.csv") + " --output " + file("a.yaml")));
  EXPECT_NE(std::string::npos, text("err").find("field 'heat' has 3 measurements"));
  write("survey.csv", survey(40));
  EXPECT_EQ(
      1, run("--survey " + file("survey.csv") + " --fields light,heet --output " + file("a.yaml")));
  EXPECT_NE(std::string::npos, text("err").find("no column 'heet'"));
  EXPECT_FALSE(std::filesystem::exists(file("a.yaml")));
}

}  // namespace
