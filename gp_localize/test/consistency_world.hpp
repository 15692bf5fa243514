// A world that matches the model: two fields drawn from the Gaussian process that the filter
// assumes, odometry noise as it assumes. For the NEES of the pose, in test_consistency and
// gp_localize_consistency.
#pragma once

#include <Eigen/Dense>
#include <chrono>
#include <cmath>
#include <fstream>
#include <string>

#include "gp_localize/gp_localize.hpp"

namespace gp_localize {

constexpr double kLength = 1.5, kSignal = 2.0, kNoise = 0.2;

/// A draw of the process by random Fourier features (Rahimi and Recht 2007).
class DrawnField {
 public:
  explicit DrawnField(field_core::Random& random) {
    for (int i = 0; i < kWaves; ++i) {
      waves_.row(i) << random.normal() / kLength, random.normal() / kLength;
      phases_[i] = random.uniform(0.0, 2.0 * M_PI);
    }
  }
  double at(const Eigen::Vector2d& p) const {
    return kSignal * std::sqrt(2.0 / kWaves) * (waves_ * p + phases_).array().cos().sum();
  }

 private:
  static constexpr int kWaves = 300;
  Eigen::Matrix<double, kWaves, 2> waves_;
  Eigen::Matrix<double, kWaves, 1> phases_;
};

/// 500 particles, the full likelihood, however few paths are left.
inline GpLocalizeParams consistency_params() {
  GpLocalizeParams p;
  FieldParams f;
  f.signal_stddev = kSignal;
  f.noise_stddev = kNoise;
  f.length_scales = {kLength, kLength};
  p.fields = {{"a", f}, {"b", f}};
  p.particles = 500;
  p.likelihood_noise_scale = 1.0;  // the model is true here
  p.diversity.paths = 0;
  p.support.region = {-4.0, -2.0, 4.0, 6.0};
  p.support.size = 81;
  p.initial_cov_xx = p.initial_cov_yy = 0.01;
  p.initial_cov_aa = 0.001;
  p.odometry_noise = {0.01, 0.002, 0.02, 0.005};
  return p;
}

/// A survey of the fields on a square grid, which is then the known map.
struct ConsistencySurvey {
  std::string file;      // to write it to; empty: none, the map is learned
  double spacing = 0.4;  // m
  double x_max = 4.0;    // m; the robot drives between about -2 and 2
  Mode mode = Mode::localization;
};

/// Start, fields and noise of one seed.
class ConsistencyDrive {
 public:
  /// @param distance of a step [m]; a lap is 12.6 m
  ConsistencyDrive(GpLocalizeParams p, int seed, const ConsistencySurvey& survey = {},
                   double distance = 0.3)
      : random_(1000 + seed),
        a_(random_),
        b_(random_),
        motion_(p.odometry_noise),
        filter_(surveyed(std::move(p), survey), seed),
        truth_(random_.normal3(Eigen::Vector3d(0.01, 0.01, 0.001).asDiagonal())),
        delta_(distance, 0.0, distance / 2.0) {}

  void step() {
    using std::chrono::seconds;
    truth_ = motion_.sample(truth_, field_core::OdometryMotion::from(delta_), random_);
    filter_.predict({seconds(time_), seconds(time_ + 1), delta_});
    ++time_;
    const Eigen::Vector2d at = truth_.translation();
    const double a = a_.at(at) + kNoise * random_.normal();
    const double b = b_.at(at) + kNoise * random_.normal();
    filter_.update({seconds(time_), {}, {{0, a, 0.0}, {1, b, 0.0}}});
  }

  const GpLocalize& filter() const { return filter_; }
  /// Estimate minus truth in x, y and yaw.
  Eigen::Vector3d error() const {
    Eigen::Vector3d e = filter_.belief().mean.vector() - truth_.vector();
    e.z() = field_core::wrap_angle(e.z());
    return e;
  }
  double nees() const { return error().dot(filter_.belief().covariance.ldlt().solve(error())); }

 private:
  GpLocalizeParams surveyed(GpLocalizeParams p, const ConsistencySurvey& survey) {
    if (survey.file.empty()) return p;
    std::ofstream csv(survey.file);
    csv << "x_m,y_m,a,b\n";
    const int side = static_cast<int>(8.0 / survey.spacing + 1e-9) + 1;
    for (int i = 0; i < side * side; ++i) {
      const Eigen::Vector2d at(-4.0 + survey.spacing * (i % side),
                               -2.0 + survey.spacing * (i / side));
      if (at.x() > survey.x_max) continue;
      csv << at.x() << "," << at.y() << "," << a_.at(at) + kNoise * random_.normal() << ","
          << b_.at(at) + kNoise * random_.normal() << "\n";
    }
    csv.close();
    p.mode = survey.mode;
    p.survey = survey.file;
    return p;
  }

  field_core::Random random_;
  DrawnField a_, b_;
  field_core::OdometryMotionModel motion_;
  GpLocalize filter_;
  field_core::SE2 truth_, delta_;
  int time_ = 0;
};

}  // namespace gp_localize
