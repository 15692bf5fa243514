// A vacuum cleaner in a room with two optical spots on the ceiling: the runs of the paper's
// figure 8.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>
#include <vector>

#include "field_core/random.hpp"
#include "field_core/se2.hpp"
#include "vector_field_slam/vector_field_slam.hpp"

namespace simulation {

using field_core::SE2;

/// One sample period: the motion that odometry reports, and what the sensor then reads.
struct Step {
  SE2 truth, odometry;  ///< odometry: increment in the robot's frame
  Eigen::Vector4d z;
};

/// Furniture: the robot keeps 0.2 m away from it, the light of the spots passes above.
struct Rectangle {
  double x_min, y_min, x_max, y_max;
};

struct Room {
  double multipath = 0.3;  ///< weight of a reflection at the wall itself
  double multipath_length = 1.0;
  double half_x = 3.0, half_y = 2.5, height = 2.5;
  double sensor_noise = 0.012;
  double heading_noise = 0.03;      ///< [rad / sqrt(m)]
  double rotation_noise = 0.03;     ///< [rad / sqrt(rad)]
  double translation_noise = 0.02;  ///< [m / sqrt(m)]
  Eigen::Vector2d offset{0.02, -0.015};
  int steps = 1200;
  SE2 start;  ///< (0, 0) drives to (1, 0) first
  std::vector<Rectangle> obstacles;
  double period_distance = 0.15, period_turn = 0.5;
};

/// Directions to the two spots, bent by mirror images at the walls.
inline Eigen::Vector4d field(const Room& s, const Eigen::Vector2d& p) {
  const Eigen::Vector2d spots[2] = {{-0.5, 0.25}, {0.5, -0.25}};
  const double walls[4] = {-s.half_x, -s.half_y, s.half_x, s.half_y};
  Eigen::Vector4d m;
  for (int k = 0; k < 2; ++k) {
    Eigen::Vector2d sum = spots[k] - p;
    double weights = 1.0;
    for (int side = 0; side < 4; ++side) {
      const int axis = side % 2;
      Eigen::Vector2d image = spots[k];
      image[axis] = 2.0 * walls[side] - spots[k][axis];
      const double w =
          s.multipath * std::exp(-std::abs(p[axis] - walls[side]) / s.multipath_length);
      sum += w * (image - p);
      weights += w;
    }
    m.segment<2>(2 * k) = sum / (weights * s.height);
  }
  return m;
}

/// RMS by which the field differs from the bilinear surface between the nodes of its cells, over
/// the places that the robot may visit: what interpolation_stddev means, known without any
/// estimate.
inline double interpolation_error(const Room& s, double cell_size) {
  const auto grid =
      vector_field_slam::GridGeometry<double>::around(s.start.x(), s.start.y(), cell_size);
  double sum = 0.0;
  int count = 0;
  for (double x = -s.half_x + 0.3; x < s.half_x - 0.3; x += 0.05) {
    for (double y = -s.half_y + 0.3; y < s.half_y - 0.3; y += 0.05) {
      vector_field_slam::GridIndex cell;
      grid.cell_of(x, y, cell);
      const vector_field_slam::Interpolation<double> at(grid, cell, x, y);
      Eigen::Vector4d error = -field(s, {x, y});
      for (int j = 0; j < 4; ++j) {
        const auto node = cell_node(cell, j);
        error += at.w[j] * field(s, {grid.node_x(node), grid.node_y(node)});
      }
      sum += error.squaredNorm();
      count += 4;
    }
  }
  return std::sqrt(sum / count);
}

/// Does the straight way between two places lead through furniture?
inline bool blocked(const Room& s, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  constexpr double kAway = 0.2, kSample = 0.05;
  const int samples = static_cast<int>((b - a).norm() / kSample) + 1;
  for (int i = 0; i <= samples; ++i) {
    const Eigen::Vector2d p = a + (b - a) * i / samples;
    for (const Rectangle& r : s.obstacles) {
      if (p.x() > r.x_min - kAway && p.x() < r.x_max + kAway && p.y() > r.y_min - kAway &&
          p.y() < r.y_max + kAway) {
        return true;
      }
    }
  }
  return false;
}

inline Eigen::Vector2d next_goal(const Room& s, const Eigen::Vector2d& from,
                                 field_core::Random& random) {
  Eigen::Vector2d goal;
  do {
    const double x = random.uniform(-s.half_x + 0.3, s.half_x - 0.3);
    goal = {x, random.uniform(-s.half_y + 0.3, s.half_y - 0.3)};
  } while (blocked(s, from, goal));
  return goal;
}

inline std::vector<Step> simulate(const Room& s, std::uint64_t seed) {
  field_core::Random random(seed);
  std::vector<Step> run;
  SE2 pose = s.start;
  Eigen::Vector2d goal = pose.translation();
  if (goal.isZero()) goal.x() = 1.0;
  while (static_cast<int>(run.size()) < s.steps) {
    const Eigen::Vector2d to = goal - pose.translation();
    const double turn = field_core::wrap_angle(std::atan2(to.y(), to.x()) - pose.yaw());
    SE2 motion;
    if (to.norm() < s.period_distance) {
      goal = next_goal(s, pose.translation(), random);
      continue;
    }
    if (std::abs(turn) > 1e-6) {
      motion = SE2(0.0, 0.0, std::clamp(turn, -s.period_turn, s.period_turn));
    } else {
      motion = SE2(s.period_distance, 0.0, 0.0);
    }
    pose = pose * motion;
    const double d = std::sqrt(motion.x()), a = std::sqrt(std::abs(motion.yaw()));
    const double slip = random.normal(0.0, 1.0), spin = random.normal(0.0, 1.0),
                 drift = random.normal(0.0, 1.0);
    Step step;
    step.truth = pose;
    step.odometry = SE2(motion.x() + s.translation_noise * d * slip, 0.0,
                        motion.yaw() + s.heading_noise * d * drift + s.rotation_noise * a * spin);
    const Eigen::Vector4d m = field(s, pose.translation());
    const Eigen::Matrix2d back = pose.rotation().transpose();
    for (int k = 0; k < 2; ++k) {
      step.z.segment<2>(2 * k) = back * m.segment<2>(2 * k) + s.offset;
    }
    for (int i = 0; i < 4; ++i) step.z[i] += random.normal(0.0, s.sensor_noise);
    run.push_back(step);
  }
  return run;
}

/// Pose straight from the readings, as if there were no reflections (the paper's "Northstar").
inline SE2 triangulate(const Room& s, const Eigen::Vector4d& z) {
  const Eigen::Vector2d spots[2] = {{-0.5, 0.25}, {0.5, -0.25}};
  const Eigen::Vector2d seen = z.head<2>() - z.tail<2>(), is = (spots[0] - spots[1]) / s.height;
  const double yaw = std::atan2(is.y(), is.x()) - std::atan2(seen.y(), seen.x());
  const Eigen::Vector2d mean = 0.5 * (z.head<2>() + z.tail<2>()) - s.offset;
  const Eigen::Vector2d p =
      0.5 * (spots[0] + spots[1]) - s.height * (Eigen::Rotation2Dd(yaw) * mean);
  return SE2(p.x(), p.y(), yaw);
}

/// Share inside the 90 % ellipse and mean NEES of (x, y) [2 is ideal] of positions as they are.
inline std::pair<double, double> consistency(const std::vector<SE2>& truth,
                                             const std::vector<SE2>& estimates,
                                             const std::vector<Eigen::Matrix2d>& covariances) {
  double share = 0.0, nees = 0.0;
  const auto n = static_cast<double>(truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const Eigen::Vector2d e = estimates[i].translation() - truth[i].translation();
    const double m = e.dot(covariances[i].inverse() * e);
    nees += m / n;
    share += (m <= 4.605) / n;
  }
  return {share, nees};
}

/// Errors of positions after rigid alignment of the estimates with the truth (least squares).
struct Aligned {
  double mean = 0.0;
  double share_inside = 0.0;  ///< of the 90 % ellipse
  double nees = 0.0;          ///< of (x, y): 2 is ideal
};

inline Aligned align(const std::vector<SE2>& truth, const std::vector<SE2>& estimates,
                     const std::vector<Eigen::Matrix2d>& covariances) {
  const auto n = static_cast<double>(truth.size());
  Eigen::Vector2d from(0.0, 0.0), to(0.0, 0.0);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    from += estimates[i].translation() / n;
    to += truth[i].translation() / n;
  }
  double along = 0.0, across = 0.0;  // of the turn that fits best
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const Eigen::Vector2d a = estimates[i].translation() - from, b = truth[i].translation() - to;
    along += a.dot(b);
    across += a.x() * b.y() - a.y() * b.x();
  }
  const Eigen::Matrix2d r = Eigen::Rotation2Dd(std::atan2(across, along)).toRotationMatrix();
  Aligned result;
  std::vector<SE2> aligned;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const Eigen::Vector2d p = r * (estimates[i].translation() - from) + to;
    result.mean += (p - truth[i].translation()).norm() / n;
    aligned.emplace_back(p.x(), p.y(), 0.0);
  }
  if (covariances.empty()) return result;
  std::vector<Eigen::Matrix2d> turned;
  for (const Eigen::Matrix2d& c : covariances) turned.emplace_back(r * c * r.transpose());
  std::tie(result.share_inside, result.nees) = consistency(truth, aligned, turned);
  return result;
}

/// Odometry noise of the estimator that matches the simulated one over a period.
inline vector_field_slam::VectorFieldSlamParams params(const Room& s) {
  vector_field_slam::VectorFieldSlamParams p;
  p.sensor_model = vector_field_slam::SensorModelType::beacon_pairs;
  for (const char* name : {"a_x", "a_y", "b_x", "b_y"}) {
    auto& c = p.channels[name];
    c.noise_stddev = s.sensor_noise;
    c.interpolation_stddev = 0.02;
    c.prior_stddev = 0.4;
  }
  const auto square = [](double x) { return x * x; };
  p.odometry_noise.alpha1 = square(s.rotation_noise) / s.period_turn;
  p.odometry_noise.alpha2 = square(s.heading_noise) / s.period_distance;
  p.odometry_noise.alpha3 = square(s.translation_noise) / s.period_distance;
  p.odometry_noise.alpha4 = 0.0;
  p.initial_pose_x = s.start.x();
  p.initial_pose_y = s.start.y();
  p.initial_pose_a = s.start.yaw();
  return p;
}

struct Outcome {
  Aligned aligned;
  double unaligned = 0.0, share_unaligned = 0.0, nees_unaligned = 0.0;
  int skipped = 0;
};

inline Outcome run(const std::vector<Step>& steps,
                   const vector_field_slam::VectorFieldSlamParams& p) {
  vector_field_slam::VectorFieldSlam filter(p, 1);
  std::vector<SE2> truth, estimates;
  std::vector<Eigen::Matrix2d> covariances;
  Outcome outcome;
  field_core::Stamp now(0);
  for (const Step& s : steps) {
    const auto next = now + std::chrono::milliseconds(500);
    filter.predict({now, next, s.odometry});
    field_core::Sample sample{next, {}, {}};
    for (int i = 0; i < 4; ++i) sample.readings.push_back({i, s.z[i], 0.0});
    outcome.skipped += !filter.update(sample).applied;
    const auto belief = filter.belief();
    truth.push_back(s.truth);
    estimates.push_back(belief.mean);
    covariances.push_back(belief.covariance.topLeftCorner<2, 2>());
    now = next;
  }
  outcome.aligned = align(truth, estimates, covariances);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    outcome.unaligned += (estimates[i].translation() - truth[i].translation()).norm() /
                         static_cast<double>(truth.size());
  }
  std::tie(outcome.share_unaligned, outcome.nees_unaligned) =
      consistency(truth, estimates, covariances);
  return outcome;
}

}  // namespace simulation
