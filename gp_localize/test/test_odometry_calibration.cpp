#include <gtest/gtest.h>

#include <cmath>

#include "gp_localize/gp_localize.hpp"
#include "gp_localize/odometry_calibration.hpp"

using namespace gp_localize;
using field_core::OdometryMotion;
using field_core::Random;
using field_core::SE2;
using std::chrono::seconds;

namespace {

CalibrationParams prior() {
  CalibrationParams p;
  p.translation_stddev = 0.2;
  p.rotation_stddev = 0.05;
  p.drift_stddev = 0.01;
  p.memory = 50.0;
  return p;
}

TEST(OdometryCalibration, CorrectsDistanceTurnAndDrift) {
  const OdometryCalibration c{0.5, 1.1, 0.02};
  const OdometryMotion m = c.correct({0.3, 2.0, -0.1});
  EXPECT_NEAR(m.trans, 1.0, 1e-15);
  EXPECT_NEAR(m.rot1 + m.rot2, 1.1 * 0.2 + 0.02 * 1.0, 1e-15);
  EXPECT_NEAR(c.correct({0.0, -2.0, 0.0}).rot1, 0.01, 1e-15);  // driving backwards drifts alike
}

TEST(OdometryCalibration, ExactWhenNothingIsUncertain) {
  const OdometryCalibrationModel model{CalibrationParams{}};
  Random random(1), untouched(1);
  OdometryCalibration c = model.draw(random);
  model.wander(3.0, c, random);
  EXPECT_EQ(c.translation, 1.0);
  EXPECT_EQ(c.rotation, 1.0);
  EXPECT_EQ(c.drift, 0.0);
  EXPECT_EQ(random.uniform(), untouched.uniform());
}

// The walk keeps the prior: its moments after any distance are those of draw(). 40000 draws have a
// standard error of 0.35 % of a standard deviation; bounds are four of them.
TEST(OdometryCalibration, WanderingKeepsThePrior) {
  const OdometryCalibrationModel model(prior());
  Random random(2);
  for (const double distance : {0.0, 5.0, 500.0}) {
    double mean = 0.0, square = 0.0, correlation = 0.0;
    constexpr int kDraws = 40000;
    for (int i = 0; i < kDraws; ++i) {
      OdometryCalibration c = model.draw(random);
      const double before = std::log(c.translation);
      model.wander(distance, c, random);
      const double after = std::log(c.translation);
      mean += after / kDraws;
      square += after * after / kDraws;
      correlation += before * after / kDraws / 0.04;
    }
    EXPECT_NEAR(mean, 0.0, 4 * 0.2 / 200);
    EXPECT_NEAR(square, 0.04, 4 * 0.04 * std::sqrt(2.0) / 200);
    EXPECT_NEAR(correlation, std::exp(-distance / 50.0), 4 * 1.5 / 200);
  }
}

// Some particles trust the odometry, for good: they are exactly 1, 1, 0 and do not wander. 10000
// draws have a standard error of 0.0043.
TEST(OdometryCalibration, MayBeKnownToBeRightWithSomeProbability) {
  CalibrationParams p = prior();
  p.calibrated_probability = 0.75;
  const OdometryCalibrationModel model(p);
  Random random(4);
  int trusted = 0;
  for (int i = 0; i < 10000; ++i) {
    OdometryCalibration c = model.draw(random);
    const bool trusts = c.translation == 1.0 && c.rotation == 1.0 && c.drift == 0.0;
    model.wander(10.0, c, random);
    EXPECT_EQ(c.translation == 1.0 && c.rotation == 1.0 && c.drift == 0.0, trusts);
    trusted += trusts;
  }
  EXPECT_NEAR(trusted / 10000.0, 0.75, 4 * 0.0043);
}

GpLocalizeParams world(double translation_stddev) {
  GpLocalizeParams p;
  FieldParams f;
  f.signal_stddev = 1.0;
  f.noise_stddev = 0.1;
  f.length_scales = {1.2, 1.2};
  p.fields = {{"field", f}};
  p.map_hypotheses = MapHypotheses::particle;
  p.support.region = {-3.0, -1.0, 3.0, 5.0};
  p.support.size = 49;
  p.initial_cov_xx = p.initial_cov_yy = p.initial_cov_aa = 1e-6;
  p.odometry_noise = {0.001, 0.001, 0.001, 0.001};
  p.odom_calibration.translation_stddev = translation_stddev;
  return p;
}

/// Rounds of a square of 2 m with wheels that report `scale` times the distance; mean error.
double drive(GpLocalize& filter, SE2& truth, int& time, int rounds, double scale) {
  double error = 0.0;
  for (int i = 0; i < rounds * 20; ++i, ++time) {
    const double turn = time % 5 == 4 ? M_PI / 2 : 0.0;
    truth = truth * SE2(0.4, 0.0, turn);
    filter.predict({seconds(time), seconds(time + 1), SE2(scale * 0.4, 0.0, turn)});
    const double value = std::sin(1.3 * truth.x()) * std::cos(1.1 * truth.y());
    filter.update({seconds(time + 1), {}, {{0, value, 0.0}}});
    error += (filter.belief().mean.translation() - truth.translation()).norm() / (rounds * 20);
  }
  return error;
}

// While a map is young its scale is as open as the odometry's: nothing can tell them apart. So the
// map is learned with good wheels, which then wear to report 20 % too much: now the map shows it.
TEST(OdometryCalibration, IsLearnedFromTheFields) {
  GpLocalizeParams p = world(0.2);
  p.odom_calibration.memory = 60.0;
  GpLocalizeParams narrow = world(0.0);
  GpLocalize filter(p, 3), without(narrow, 3);
  for (GpLocalize* each : {&filter, &without}) {
    SE2 truth;
    int time = 0;
    each->set_pose(SE2(), Eigen::Matrix3d::Zero());
    drive(*each, truth, time, 6, 1.0);
    const double error = drive(*each, truth, time, 10, 1.2);
    if (each == &without) {
      EXPECT_NEAR(each->calibration().translation, 1.0, 1e-12);
    } else {
      // 1 / 1.2 = 0.833; a walk that forgets over 60 m pulls a few percent towards 1.
      EXPECT_NEAR(each->calibration().translation, 1.0 / 1.2, 0.08);
      EXPECT_LT(error, 0.5);
    }
  }
}

TEST(OdometryCalibration, ExactOdometryNeedsNone) {
  GpLocalizeParams p = world(0.2);
  p.odometry_noise = {0.0, 0.0, 0.0, 0.0};
  GpLocalize filter(p, 3);
  SE2 truth;
  int time = 0;
  drive(filter, truth, time, 1, 1.0);
  EXPECT_NEAR(filter.calibration().translation, 1.0, 1e-12);
}

}  // namespace
