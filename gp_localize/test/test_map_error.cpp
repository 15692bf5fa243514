// Readings on a known map that err together: the count and the power by hand, the integrals
// numerically, and what the filter makes of them.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "../src/map_error.hpp"
#include "exact_drive.hpp"
#include "field_core/errors.hpp"

using namespace gp_localize;
using field_core::KernelType;
using std::chrono::seconds;

namespace {

constexpr double kX = 1.5, kY = 2.0;  // length scales of exact_params()

GpLocalizeParams known() {
  GpLocalizeParams p = exact_params();
  p.mode = Mode::localization;
  return p;
}

double rho(KernelType type, double d) { return field_core::correlation(type, d * d); }

// The gradient's correlation is the kernel's second derivative: along a line rho''(d) / rho''(0),
// across it rho'(d) / d / rho''(0).
TEST(MapError, IntegralsAreThoseOfKernelTimesGradient) {
  constexpr double kStep = 1e-3;
  for (const KernelType type :
       {KernelType::squared_exponential, KernelType::matern32, KernelType::matern52}) {
    const auto slope = [&](double d) {
      return (rho(type, d + kStep) - rho(type, d - kStep)) / (2 * kStep);
    };
    const double at_zero = slope(kStep) / kStep;  // rho'(0) is 0
    double sum = 0.0;
    for (double d = 1.5 * kStep; d < 20.0; d += kStep) {
      const double along = (slope(d + kStep) - slope(d - kStep)) / (2 * kStep);
      sum += kStep * rho(type, d) * (along + slope(d) / d) / at_zero;  // both sides, mean of two
    }
    EXPECT_NEAR(MapError::integral(type), sum, 0.01) << static_cast<int>(type);
  }
}

constexpr double kV = 0.5, kN = 1.5;  // of the map and of the noise: a share of a quarter

double read(MapError& error, double map_variance = kV, double noise_variance = kN) {
  const double power = error.power(0, map_variance, noise_variance);
  error.accept(0);
  return power;
}

double power_of(double repeated) { return (kN + kV) / (kN + kV * repeated); }
const double kMemory = 0.5 * 0.75 * std::sqrt(M_PI) * std::sqrt(kX * kY);

TEST(MapError, PowerIsThatOfReadingsThatErrTogether) {
  const GpLocalizeParams p = known();
  MapError error(p, make_field_models(p));
  EXPECT_DOUBLE_EQ(read(error), 1.0);  // nothing read before
  error.move(0.3);
  EXPECT_DOUBLE_EQ(error.power(0, kV, kN), power_of(1.0 + 2.0 * std::exp(-0.3 / kMemory)));
  EXPECT_DOUBLE_EQ(error.power(0, 0.0, kN), 1.0);  // a certain map: the noise is independent
  read(error);
  error.move(0.3);
  error.move(0.4);
  const double count = std::exp(-1.0 / kMemory) + std::exp(-0.7 / kMemory);
  EXPECT_DOUBLE_EQ(error.power(0, kV, kN), power_of(1.0 + 2.0 * count));
  error.restart();
  EXPECT_DOUBLE_EQ(error.power(0, kV, kN), 1.0);
}

// Over a steady drive as many as the integral has room for between two readings.
TEST(MapError, SteadyDriveRepeatsTheIntegral) {
  const GpLocalizeParams p = known();
  MapError error(p, make_field_models(p));
  constexpr double kStep = 0.02;
  double power = 0.0;
  for (int i = 0; i < 2000; ++i) {
    error.move(kStep);
    power = read(error);
  }
  const double expected = power_of(2.0 * kMemory / kStep);
  EXPECT_NEAR(power, expected, 0.001 * expected);
}

// Encoders may jitter: less than a millimetre in all is no motion.
TEST(MapError, StandingStillCountsEveryReadingAndDrivingOnOnlyOne) {
  const GpLocalizeParams p = known();
  MapError error(p, make_field_models(p));
  for (int i = 0; i < 1000; ++i) {
    EXPECT_DOUBLE_EQ(read(error), power_of(1.0 + 2.0 * i));
    error.move(i % 2 == 0 ? 0.0 : 1e-6);
  }
  error.move(0.4);
  const double driven = 0.4 + 500 * 1e-6;
  EXPECT_NEAR(error.power(0, kV, kN), power_of(1.0 + 2.0 * std::exp(-driven / kMemory)), 1e-12);
}

TEST(MapError, ConcernsOnlyMapsThatAreNotLearned) {
  for (const Mode mode : {Mode::mapping, Mode::lifelong, Mode::localization}) {
    GpLocalizeParams p = exact_params();
    p.mode = mode;
    EXPECT_EQ(MapError(p, make_field_models(p)).active(), mode == Mode::localization);
    p.map_error_correlation = false;
    EXPECT_FALSE(MapError(p, make_field_models(p)).active());
  }
}

TEST(MapError, RestoresWhatItSaves) {
  const GpLocalizeParams p = known();
  MapError error(p, make_field_models(p)), copy(p, make_field_models(p));
  read(error);
  error.move(0.3);
  read(error);
  error.move(0.0006);  // half of a motion
  field_core::State state("gp_localize", 1);
  error.save(state);
  copy.restore(state);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(read(copy), read(error));
    for (MapError* each : {&error, &copy}) each->move(0.0006);
  }
}

TEST(MapError, RefusesADamagedState) {
  const GpLocalizeParams p = known();
  MapError error(p, make_field_models(p));
  read(error);
  field_core::State state("gp_localize", 1);
  error.restore(state);  // saved while mapping
  EXPECT_DOUBLE_EQ(error.power(0, kV, kN), 1.0);
  for (const double wrong : {-1.0, static_cast<double>(NAN)}) {
    state.set("readings_near", Eigen::MatrixXd(Eigen::Vector2d(wrong, 1.0)));
    EXPECT_THROW(error.restore(state), field_core::DataError);
  }
}

class MapErrorInTheFilter : public ::testing::Test {
 protected:
  MapErrorInTheFilter() {
    std::string name = (std::filesystem::temp_directory_path() / "map_error.XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    std::ofstream csv(folder_ + "/survey.csv");
    csv << "x_m,y_m,light\n0,0,3.2\n2,1,2.5\n-1,3,3.9\n1,4,2.2\n";
  }
  ~MapErrorInTheFilter() override { std::filesystem::remove_all(folder_); }

  GpLocalizeParams params() const {
    GpLocalizeParams p = resampling(known());
    p.survey = folder_ + "/survey.csv";
    return p;
  }
  static void drive(GpLocalize& filter, int from, int to) {
    for (int t = from; t < to; ++t) {
      filter.predict({seconds(t), seconds(t + 1), exact_motion(t)});
      filter.update({seconds(t + 1), {}, {{0, 3.0 + std::sin(0.4 * t), 0.0}}});
    }
  }

  std::string folder_;
};

// The same reading twice, without resampling: logarithms of two weights differ by the power, which
// is that of the particles' mean variance.
TEST_F(MapErrorInTheFilter, RaisesEachReadingToItsPower) {
  GpLocalizeParams p = params();
  constexpr int kFirst = 2, kSecond = 40;
  p.resample_threshold = 0.0;
  p.initial_cov_xx = p.initial_cov_yy = 0.25;
  p.fields["light"].noise_stddev = 1.5;
  const auto spread = [](const GpLocalize& filter) {  // of a particle and one that it tells apart
    const auto particles = filter.belief().particles;
    return std::log(particles[kFirst].weight / particles[kSecond].weight);
  };
  GpLocalize careful(p, 1), once(p, 1);
  p.map_error_correlation = false;
  GpLocalize plain(p, 1);
  for (GpLocalize* filter : {&careful, &once, &plain}) {
    filter->update({seconds(1), {}, {{0, 3.4, 0.0}}});
  }
  EXPECT_EQ(spread(careful), spread(plain));  // the first reading counts in full
  constexpr double kNoise = 1.5 * 1.5;
  double variance = 0.0;
  for (const auto& particle : careful.belief().particles) {
    const Eigen::Matrix2Xd at = particle.pose.translation();
    variance += particle.weight * (careful.predict_field(at).variance(0, 0) - kNoise);
  }
  for (GpLocalize* filter : {&careful, &plain}) {
    filter->update({seconds(2), {}, {{0, 3.4, 0.0}}});
  }
  EXPECT_NEAR(spread(plain), 2.0 * spread(once), 1e-9);
  const double power = (kNoise + variance) / (kNoise + variance * 3.0);
  EXPECT_GT(std::abs(spread(once)), 0.01);
  EXPECT_LT(power, 0.9);
  EXPECT_NEAR(spread(careful), (1.0 + power) * spread(once), 1e-6);
}

TEST_F(MapErrorInTheFilter, ARestoredStateGoesOnBitForBit) {
  GpLocalize original(params(), 1), copy(params(), 9);
  drive(original, 0, 25);
  copy.restore(original.state());
  drive(original, 25, 40);
  drive(copy, 25, 40);
  EXPECT_EQ(original.belief().mean.vector(), copy.belief().mean.vector());
}

}  // namespace
