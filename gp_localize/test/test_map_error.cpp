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

TEST(MapError, PowerIsThatOfReadingsThatErrTogether) {
  const GpLocalizeParams p = known();
  MapError error(p, make_field_models(p));
  EXPECT_DOUBLE_EQ(error.power(0, 0.5, 0.1), 1.0);  // nothing read before
  error.accept(0);
  error.accept(0);
  EXPECT_DOUBLE_EQ(error.power(0, 0.5, 0.1), 0.6 / (0.1 + 0.5 * 5.0));
  EXPECT_DOUBLE_EQ(error.power(0, 0.0, 0.1), 1.0);  // the map is certain: the noise is independent
  const double memory = 0.5 * 0.75 * std::sqrt(M_PI) * std::sqrt(kX * kY);
  error.move(0.3);
  error.move(0.7);
  EXPECT_NEAR(error.power(0, 0.5, 0.1), 0.6 / (0.1 + 0.5 * (1.0 + 4.0 * std::exp(-1.0 / memory))),
              1e-12);
  error.restart();
  EXPECT_DOUBLE_EQ(error.power(0, 0.5, 0.1), 1.0);
}

// Over a steady drive the count is the integral over the distance between readings.
TEST(MapError, SteadyDriveCountsTheIntegral) {
  const GpLocalizeParams p = known();
  MapError error(p, make_field_models(p));
  constexpr double kStep = 0.02;
  for (int i = 0; i < 2000; ++i) {
    error.move(kStep);
    if (i < 1999) error.accept(0);
  }
  const double repeated = 0.75 * std::sqrt(M_PI) * std::sqrt(kX * kY) / kStep;
  EXPECT_NEAR(1.0 / error.power(0, 1.0, 0.0), repeated, 0.01 * repeated);
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

TEST(MapError, RefusesADamagedState) {
  const GpLocalizeParams p = known();
  MapError error(p, make_field_models(p));
  error.accept(0);
  field_core::State state("gp_localize", 1);
  error.restore(state);  // saved while mapping
  EXPECT_DOUBLE_EQ(error.power(0, 1.0, 1.0), 1.0);
  for (const double wrong : {-1.0, static_cast<double>(NAN)}) {
    state.set("readings_near", wrong);
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

// The same reading twice: the weights' logarithms, all resampling off, differ by the power.
TEST_F(MapErrorInTheFilter, RaisesEachReadingToItsPower) {
  GpLocalizeParams p = params();
  p.resample_threshold = 0.0;
  p.initial_cov_xx = p.initial_cov_yy = 0.25;
  const auto spread = [](const GpLocalize& filter) {
    const auto particles = filter.belief().particles;
    return std::log(particles[0].weight / particles[1].weight);
  };
  GpLocalize careful(p, 1), once(p, 1);
  p.map_error_correlation = false;
  GpLocalize plain(p, 1);
  for (GpLocalize* filter : {&careful, &once, &plain}) {
    filter->update({seconds(1), {}, {{0, 3.4, 0.0}}});
  }
  EXPECT_EQ(spread(careful), spread(plain));  // the first reading counts in full
  for (GpLocalize* filter : {&careful, &plain}) {
    filter->update({seconds(2), {}, {{0, 3.4, 0.0}}});
  }
  EXPECT_NEAR(spread(plain), 2.0 * spread(once), 1e-9);
  const double power = spread(careful) / spread(once) - 1.0;
  // The map's variance is between 0 and that of the field, its noise 0.04, repeated 3 times.
  EXPECT_GT(power, 1.04 / (0.04 + 3.0));
  EXPECT_LT(power, 0.9);
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
