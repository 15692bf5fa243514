// Two correlated fields, a and b, and a robot that drives a circle among them.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <fstream>
#include <string>

#include "gp_localize/gp_localize.hpp"

namespace gp_localize {

constexpr double kLength = 1.5, kNoise = 0.2, kCorrelation = 0.8;

inline GpLocalizeParams params(double correlation = kCorrelation) {
  GpLocalizeParams p;
  FieldParams f;
  f.noise_stddev = kNoise;
  f.length_scales = {kLength, kLength};
  f.mean = 5.0;
  f.signal_stddev = 2.0;
  p.fields["a"] = f;
  f.mean = -3.0;
  f.signal_stddev = 1.0;
  p.fields["b"] = f;
  p.coregionalization["room"] = {{"a", "b"}, {correlation}};
  p.particles = 200;
  p.sample_paths = 100;
  p.slice_size = 8;
  p.likelihood_noise_scale = 1.0;  // the model is true here
  p.support.region = {-4.0, -2.0, 4.0, 6.0};
  p.support.size = 64;
  p.initial_cov_xx = p.initial_cov_yy = 0.01;
  p.initial_cov_aa = 0.001;
  p.odometry_noise = {0.01, 0.002, 0.02, 0.005};
  return p;
}

/// Two draws of one process by random Fourier features, mixed to be correlated.
class World {
 public:
  explicit World(int seed, double correlation = kCorrelation)
      : random_(seed), correlation_(correlation) {
    for (int i = 0; i < kWaves; ++i) {
      for (int f : {0, 1}) {
        waves_[f].row(i) << random_.normal() / kLength, random_.normal() / kLength;
        phases_[f][i] = random_.uniform(0.0, 2.0 * M_PI);
      }
    }
  }
  double a(const Eigen::Vector2d& p) const { return 5.0 + 2.0 * draw(0, p); }
  double b(const Eigen::Vector2d& p) const {
    const double rest = std::sqrt(1.0 - correlation_ * correlation_);
    return -3.0 + correlation_ * draw(0, p) + rest * draw(1, p);
  }
  /// Drives a circle; now and then a field, or both, are not read. The mean error.
  double run(GpLocalize& filter, int steps, bool only_b = false) {
    const field_core::OdometryMotionModel motion({0.01, 0.002, 0.02, 0.005});
    double error = 0.0;
    for (int t = 0; t < steps; ++t, ++time_) {
      const field_core::SE2 delta(0.3, 0.0, 0.15);
      truth_ = motion.sample(truth_, field_core::OdometryMotion::from(delta), random_);
      filter.predict({std::chrono::seconds(time_), std::chrono::seconds(time_ + 1), delta});
      const Eigen::Vector2d at = truth_.translation();
      field_core::Sample sample{std::chrono::seconds(time_ + 1), {}, {}};
      if (only_b || time_ % 4 != 1)
        sample.readings.push_back({1, b(at) + kNoise * random_.normal(), 0.0});
      if (!only_b && time_ % 3 != 1)
        sample.readings.push_back({0, a(at) + kNoise * random_.normal(), 0.0});
      if (!sample.readings.empty()) {
        EXPECT_TRUE(filter.update(sample).applied);
      }
      error += (filter.belief().mean.translation() - at).norm() / steps;
    }
    return error;
  }
  /// a at two of three places, b at every `nth`.
  void write_survey(const std::string& file, int nth = 1) {
    std::ofstream csv(file);
    csv << "x_m,y_m,a,b\n";
    for (int i = 0; i < 17 * 17; ++i) {
      const Eigen::Vector2d at(-4.0 + 0.5 * (i % 17), -2.0 + 0.5 * (i / 17));
      csv << at.x() << "," << at.y() << ",";
      if (i % 3 != 0) csv << a(at) + kNoise * random_.normal();
      csv << ",";
      if (i % nth == nth / 3) csv << b(at) + kNoise * random_.normal();
      csv << "\n";
    }
  }

 private:
  double draw(int f, const Eigen::Vector2d& p) const {
    return std::sqrt(2.0 / kWaves) * (waves_[f] * p + phases_[f]).array().cos().sum();
  }
  static constexpr int kWaves = 200;
  field_core::Random random_;
  double correlation_;
  Eigen::Matrix<double, kWaves, 2> waves_[2];
  Eigen::Matrix<double, kWaves, 1> phases_[2];
  field_core::SE2 truth_;
  int time_ = 0;
};

}  // namespace gp_localize
