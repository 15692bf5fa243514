// The level of a field drifts against its known map: the offset filter against a dense Gaussian of
// the whole run, and what it is good for.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <Eigen/Dense>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "field_core/errors.hpp"
#include "gp_localize/gp_localize.hpp"

using namespace gp_localize;
using field_core::SE2;
using std::chrono::seconds;

namespace {

constexpr double kSignal = 2.0, kNoise = 0.2;

double light_at(const Eigen::Vector2d& p) {
  return 7.0 + 2.0 * std::sin(0.9 * p.x()) * std::cos(0.8 * p.y()) + 0.3 * p.x();
}

class FieldOffset : public ::testing::Test {
 protected:
  FieldOffset() {
    std::string name = (std::filesystem::temp_directory_path() / "field_offset.XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    std::ofstream csv(folder_ + "/survey.csv");
    csv << "x_m,y_m,light\n";
    for (int i = 0; i < 17 * 17; ++i) {
      const Eigen::Vector2d p(-4.0 + 0.5 * (i % 17), -4.0 + 0.5 * (i / 17));
      csv << p.x() << "," << p.y() << "," << light_at(p) << "\n";
    }
  }
  ~FieldOffset() override { std::filesystem::remove_all(folder_); }

  GpLocalizeParams params(double stddev) const {
    GpLocalizeParams p;
    FieldParams f;
    f.mean = 7.0;
    f.signal_stddev = kSignal;
    f.noise_stddev = kNoise;
    f.length_scales = {1.8, 1.8};
    p.fields = {{"light", f}};
    p.mode = Mode::localization;
    p.survey = folder_ + "/survey.csv";
    p.particles = 1;
    p.likelihood_noise_scale = 1.0;
    p.support.region = {-4.0, -4.0, 4.0, 4.0};
    p.support.size = 81;
    p.field_offset.stddev = stddev;
    p.field_offset.memory = 20.0;
    p.initial_pose_x = 2.0;
    p.initial_cov_xx = p.initial_cov_yy = p.initial_cov_aa = 0.0;
    p.odometry_noise = {0.0, 0.0, 0.0, 0.0};
    return p;
  }

  /// Mean position error over `steps` on a circle, with light that fades by `drift` per second.
  double drive(const GpLocalizeParams& p, int steps, double drift, std::uint64_t seed) const {
    GpLocalize filter(p, seed);
    field_core::Random random(seed + 100);
    const field_core::OdometryMotionModel motion(p.odometry_noise);
    SE2 truth(2.0, 0.0, 0.0);
    double error = 0.0;
    for (int t = 0; t < steps; ++t) {
      const SE2 delta(0.3, 0.0, 0.15 + 0.1 * std::sin(0.2 * t));
      truth = motion.sample(truth, field_core::OdometryMotion::from(delta), random);
      filter.predict({seconds(t), seconds(t + 1), delta});
      const double value = light_at(truth.translation()) - drift * t + kNoise * random.normal();
      filter.update({seconds(t + 1), {}, {{0, value, 0.0}}});
      error += (filter.belief().mean.translation() - truth.translation()).norm() / steps;
    }
    return error;
  }

  std::string folder_;
};

TEST_F(FieldOffset, IsAnOrnsteinUhlenbeckProcessBesideTheMap) {
  const GpLocalizeParams p = params(0.5);
  GpLocalize filter(p, 1), map(params(0.0), 1);
  constexpr int kSteps = 12;
  Eigen::VectorXd r(kSteps), time(kSteps), own(kSteps);
  double nis = 0.0;
  SE2 pose(2.0, 0.0, 0.0);
  int now = 0;
  for (int i = 0; i < kSteps; ++i) {
    const SE2 delta(0.3, 0.0, 0.2);
    const int wait = 1 + (i * i) % 7;  // irregular times
    pose = pose * delta;
    filter.predict({seconds(now), seconds(now + wait), delta});
    now += wait;
    const Eigen::Matrix2Xd place = pose.translation();
    const double value = light_at(place) + 1.0 + 0.3 * std::sin(5.0 * i);
    nis += filter.update({seconds(now), {}, {{0, value, 0.0}}}).nis;
    const auto prediction = map.predict_field(place);
    r[i] = value - prediction.mean(0, 0);
    own[i] = prediction.variance(0, 0);
    time[i] = now;
  }
  Eigen::MatrixXd covariance = own.asDiagonal();
  for (int i = 0; i < kSteps; ++i) {
    for (int j = 0; j < kSteps; ++j) {
      covariance(i, j) += 0.25 * kSignal * kSignal * std::exp(-std::abs(time[i] - time[j]) / 20.0);
    }
  }
  EXPECT_NEAR(nis, r.dot(covariance.ldlt().solve(r)), 1e-6 * nis);
}

TEST_F(FieldOffset, FollowsADriftThatLosesTheFilterWithoutIt) {
  double with = 0.0, without = 0.0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    for (const double stddev : {0.0, 1.0}) {
      GpLocalizeParams p = params(stddev);
      p.particles = 300;
      p.field_offset.memory = 300.0;
      p.odometry_noise = {0.01, 0.002, 0.01, 0.002};
      (stddev > 0.0 ? with : without) += drive(p, 150, 0.02, seed) / 5;
    }
  }
  RecordProperty("with_m", std::to_string(with));
  RecordProperty("without_m", std::to_string(without));
  EXPECT_LT(with, 0.5 * without);
  EXPECT_LT(with, 0.6);
}

TEST_F(FieldOffset, IsSavedAndRestored) {
  GpLocalizeParams p = params(0.5);
  p.particles = 40;
  p.odometry_noise = {0.01, 0.01, 0.01, 0.01};
  GpLocalize first(p, 1), second(p, 2);
  const auto step = [](GpLocalize& filter, int t) {
    filter.predict({seconds(t), seconds(t + 1), SE2(0.2, 0.0, 0.2)});
    filter.update({seconds(t + 1), {}, {{0, 6.0 + std::sin(0.3 * t), 0.0}}});
  };
  for (int t = 0; t < 15; ++t) step(first, t);
  second.restore(first.state());
  for (int t = 15; t < 30; ++t) {
    step(first, t);
    step(second, t);
  }
  EXPECT_EQ(first.belief().mean.vector(), second.belief().mean.vector());
  EXPECT_EQ(first.belief().covariance, second.belief().covariance);
}

TEST_F(FieldOffset, NeedsAMapThatStaysAsItIs) {
  GpLocalizeParams p = params(0.5);
  EXPECT_NO_THROW(p.validate());
  p.mode = Mode::lifelong;
  EXPECT_THROW(p.validate(), field_core::ParameterError);
}

}  // namespace
