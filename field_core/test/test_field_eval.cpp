// field_eval as a program: exit codes, one-line errors, numbers, files.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <regex>
#include <string>

#include "support.hpp"

namespace field_core {
namespace {

struct Outcome {
  int code = 0;
  std::string output, errors;
};

class FieldEval : public ::testing::Test {
 protected:
  // The truth drives 3 m along x; the estimate is off by 0, 1, 0, 3 m across.
  void SetUp() override {
    const std::string head = "stamp_s,x_m,y_m,yaw_rad";
    folder_.write("truth.csv", head + "\n0,0,0,0\n1,1,0,0\n2,2,0,0\n3,3,0,0\n");
    folder_.write("estimate.csv", head +
                                      ",cov_xx,cov_xy,cov_xa,cov_yy,cov_ya,cov_aa\n"
                                      "0,0,0,0,1,0,0,1,0,1\n1,1,1,0,1,0,0,1,0,1\n"
                                      "2,2,0,0,1,0,0,1,0,1\n3,3,3,0,1,0,0,1,0,1\n");
    folder_.write("odometry.csv", head + "\n0,5,5,0\n1,5.5,5,0\n2,6,5,0\n3,6.5,5,0\n");
    folder_.write("field_light.csv", "x_m,y_m,mean,variance\n0,0,1,1\n1,0,2,1\n0,1,3,4\n1,1,4,1\n");
  }

  Outcome run(const std::string& arguments, const std::string& environment = "") const {
    const std::string errors = folder_.file("stderr"), in = "cd '" + folder_.file("") + "' && ";
    const std::string command = in + environment + " " + FIELD_EVAL + " " + arguments + " 2>stderr";
    Outcome outcome;
    FILE* pipe = ::popen(command.c_str(), "r");
    char buffer[4096];
    for (std::size_t n; (n = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;) {
      outcome.output.append(buffer, n);
    }
    const int status = ::pclose(pipe);
    outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    outcome.errors = test::content_of(errors);
    std::filesystem::remove(errors);
    return outcome;
  }

  void expect_failure(const std::string& arguments, int code, const std::string& part,
                      const std::string& environment = "") const {
    SCOPED_TRACE(arguments);
    const std::size_t files = folder_.count();
    const Outcome outcome = run(arguments, environment);
    EXPECT_EQ(outcome.code, code);
    EXPECT_EQ(outcome.output, "");
    EXPECT_EQ(std::count(outcome.errors.begin(), outcome.errors.end(), '\n'), 1) << outcome.errors;
    EXPECT_NE(outcome.errors.find(part), std::string::npos) << outcome.errors;
    EXPECT_EQ(folder_.count(), files) << "something half-written was left behind";
  }

  // A stand-in for rosrun that prints a trajectory and records its arguments.
  std::string fake_rosrun(const std::string& body) const {
    std::filesystem::create_directory(folder_.file("bin"));
    const std::string path = folder_.write("bin/rosrun", "#!/bin/sh\n" + body);
    ::chmod(path.c_str(), 0755);
    return "PATH='" + folder_.file("bin") + "':$PATH";
  }

  test::TemporaryFolder folder_;
};

double json_number(const std::string& json, const std::string& key) {
  std::smatch match;
  const std::regex pattern("\"" + key + "\": ([-+0-9.e]+)");
  if (!std::regex_search(json, match, pattern)) {
    ADD_FAILURE() << key << " is not in " << json;
    return 0.0;
  }
  return std::stod(match[1]);
}

const char* const kPair = "--truth truth.csv --estimate estimate.csv ";

TEST_F(FieldEval, PrintsTheTableAndWritesTheSameNumbers) {
  const Outcome outcome = run(std::string(kPair) +
                              "--baseline odometry=odom:odometry.csv "
                              "--baseline odometry_best_scale=scaled:odometry.csv --json o.json");
  ASSERT_EQ(outcome.code, 0) << outcome.errors;
  EXPECT_EQ(outcome.errors, "");
  const std::regex estimate(R"(\nestimate +4 +1\.000 +0\.500 +1\.581 +2\.700 +3\.000 +3\.000 )");
  EXPECT_TRUE(std::regex_search(outcome.output, estimate)) << outcome.output;
  // Odometry reads half of what was driven: errors 0, 0.5, 1, 1.5; no covariance, no NEES.
  const std::regex odometry(R"(\nodometry +4 +0\.750 .* - +-\n)");
  EXPECT_TRUE(std::regex_search(outcome.output, odometry)) << outcome.output;
  const std::string json = test::content_of(folder_.file("o.json"));
  EXPECT_DOUBLE_EQ(json_number(json, "position_error_mean_m"), 1.0);
  EXPECT_DOUBLE_EQ(json_number(json, "position_error_rmse_m"), std::sqrt(2.5));
  EXPECT_DOUBLE_EQ(json_number(json, "nees"), 2.5);  // (0 + 1 + 0 + 9) / 4
  EXPECT_DOUBLE_EQ(json_number(json, "share_inside_90_ellipse"), 0.75);
  EXPECT_NEAR(json_number(json, "translation_scale"), 2.0, 1e-4);
  EXPECT_NE(json.find("\"nees\": null"), std::string::npos);
}

TEST_F(FieldEval, BaselinesAreComparedOverTheSpanOfTheEstimate) {
  folder_.write("long.tum", "0 0 0 0 0 0 0 1\n3 3 0 0 0 0 0 1\n3.5 9 9 0 0 0 0 1\n");
  const Outcome outcome = run(std::string(kPair) + "--baseline other=long.tum --align first");
  ASSERT_EQ(outcome.code, 0) << outcome.errors;
  EXPECT_TRUE(std::regex_search(outcome.output, std::regex(R"(\nother +2 +0\.000 )")));
}

TEST_F(FieldEval, HelpIsNoError) {
  const Outcome outcome = run("--help");
  EXPECT_EQ(outcome.code, 0);
  EXPECT_NE(outcome.output.find("--baseline"), std::string::npos);
}

TEST_F(FieldEval, MisuseEndsWithTwo) {
  expect_failure("", 2, "--truth");
  expect_failure(std::string(kPair) + "--align worst", 2, "worst");
  expect_failure(std::string(kPair) + "--shiny", 2, "--shiny");
  expect_failure(std::string(kPair) + "--baseline odometry.csv", 2, "NAME=odom:FILE");
  expect_failure(std::string(kPair) + "--baseline o=odom:x.txt", 2, "x.txt");
  expect_failure("--truth run.bag --estimate estimate.csv", 2, "run.bag:/topic");
  expect_failure(std::string(kPair) + "--plot picture.bmp", 2, "picture.bmp");
  expect_failure(std::string(kPair) + "--map field_light.csv", 2, "--plot");
  expect_failure(std::string(kPair) + "--relative-distance -1", 2, "relative-distance");
}

TEST_F(FieldEval, BadDataEndsWithOne) {
  expect_failure("--truth none.csv --estimate estimate.csv --json o.json", 1, "'none.csv'");
  folder_.write("nan.csv", "stamp_s,x_m,y_m,yaw_rad\n0,0,0,0\n1,nan,0,0\n");
  expect_failure("--truth truth.csv --estimate nan.csv", 1, "nan.csv:3");
  folder_.write("late.csv", "stamp_s,x_m,y_m,yaw_rad\n100,0,0,0\n");
  expect_failure("--truth truth.csv --estimate late.csv", 1, "late.csv");
  expect_failure(std::string(kPair) + "--baseline b=late.csv", 1, "late.csv");
  expect_failure(std::string(kPair) + "--json no/such/o.json", 1, "no/such/o.json");
  expect_failure(std::string(kPair) + "--plot o.png --map none.csv", 1, "none.csv");
  expect_failure(std::string(kPair) + "--plot o.png --map truth.csv --json o.json", 1, "variance");
  expect_failure(std::string(kPair) + "--plot no/such/o.png", 1, "no/such/o.png");
}

TEST_F(FieldEval, DrawsPictures) {
  const Outcome outcome =
      run(std::string(kPair) + "--plot o.png --map field_light.csv --map-unit lx --title Demo");
  ASSERT_EQ(outcome.code, 0) << outcome.errors;
  const std::string picture = test::content_of(folder_.file("o.png"));
  EXPECT_EQ(picture.substr(0, 8), "\x89PNG\r\n\x1a\n");
  EXPECT_GT(picture.size(), 20000u);
}

TEST_F(FieldEval, ReadsTopicsOfBagsThroughRosrun) {
  const std::string path = fake_rosrun("echo \"$@\" >called\ncat truth.csv\n");
  const Outcome outcome = run("--truth 'my run.bag:/ground_truth' --estimate estimate.csv", path);
  ASSERT_EQ(outcome.code, 0) << outcome.errors;
  EXPECT_EQ(test::content_of(folder_.file("called")),
            "field_ros bag_trajectory my run.bag /ground_truth\n");
  EXPECT_TRUE(std::regex_search(outcome.output, std::regex(R"(\nestimate +4 +1\.000 )")));
}

TEST_F(FieldEval, RelaysWhatRosrunSays) {
  const std::string arguments = "--truth run.bag:/t --estimate estimate.csv";
  const auto failing =
      fake_rosrun("echo noise >&2; echo 'run.bag: no topic /t; has /odom' >&2; exit 1\n");
  expect_failure(arguments, 1, "no topic /t; has /odom", failing);
  const auto broken = fake_rosrun("printf 'stamp_s,x_m,y_m,yaw_rad\\n0,nan,0,0\\n'\n");
  expect_failure(arguments, 1, "run.bag:/t:2", broken);
  expect_failure(arguments, 1, "setup.bash", "PATH=/nowhere");
}

}  // namespace
}  // namespace field_core
