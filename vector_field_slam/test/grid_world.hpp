// A robot that roams a square under two optical spots, for the tests and the benchmark of the batch
// solver: a smooth field that bilinear interpolation represents nearly, and any size of map.
#pragma once

#include <cmath>

#include "field_core/odometry_motion_model.hpp"
#include "field_core/random.hpp"
#include "vector_field_slam/batch_log.hpp"
#include "vector_field_slam/eseif_solver.hpp"

namespace grid_world {

using namespace vector_field_slam;
using field_core::SE2;

struct Options {
  double side = 4.0;    ///< of the square [m]
  double step = 0.4;    ///< between samples [m]
  double slope = 0.4;   ///< of the field [1/m]: one over the height of the spots
  double bend = 0.02;   ///< amplitude of the field's deviation from a plane
  double noise = 0.02;  ///< of the sensor
  field_core::OdometryNoise odometry{0.0001, 0.0001, 0.0005, 0.00001};
};

inline VectorFieldSlamParams params(const Options& o) {
  VectorFieldSlamParams p;
  p.sensor_model = SensorModelType::beacon_pairs;
  for (const char* name : {"a_x", "a_y", "b_x", "b_y"}) {
    p.channels[name].noise_stddev = o.noise;
    p.channels[name].prior_stddev = 0.5;
  }
  p.odometry_noise = o.odometry;
  return p;
}

/// Drives `samples` steps through the square along its rows, up and down again and again with some
/// wandering, feeding the online solver and the log.
class World {
 public:
  static constexpr int M = 4;

  World(const Options& o, std::uint64_t seed)
      : options(o),
        settings(params(o)),
        model(settings, make_channels(settings)),
        motion(o.odometry),
        random(seed),
        log(model),
        online(model, EseifOptions{}) {
    StartState s;
    s.robot << 0.0, 0.0, 0.0, 0.0, 0.0;
    s.covariance = RobotVector(1e-4, 1e-4, 1e-4, 2.5e-3, 2.5e-3).asDiagonal();
    s.cell = {0, 0};
    s.node_values.resize(M, 4);
    for (int j = 0; j < 4; ++j) {
      s.node_values.col(j) =
          field(model.grid.node_x(cell_node(s.cell, j)), model.grid.node_y(cell_node(s.cell, j)));
    }
    online.start(s);
    log.start(s);
    poses.push_back(truth);
  }

  Eigen::Vector4d field(double x, double y) const {
    const double b = options.bend * std::sin(0.7 * x) * std::cos(0.9 * y);
    const double dx = options.slope * x, dy = options.slope * y;
    return {0.5 - dx + b, 0.3 - dy - b, -0.2 - dx - b, 0.1 - dy + b};
  }

  void drive(int samples) {
    for (int k = 0; k < samples; ++k) step();
  }

  Options options;
  VectorFieldSlamParams settings;
  Model<M> model;
  field_core::OdometryMotionModel motion;
  field_core::Random random;
  BatchLog<M> log;
  EseifSolver<M> online;
  SE2 truth;
  std::vector<SE2> poses;  ///< true, of every pose of the log

 private:
  void step() {
    Eigen::Vector2d to = goal_ - truth.translation();
    if (to.norm() < options.step) {
      next_goal();
      to = goal_ - truth.translation();
    }
    const double turn = field_core::wrap_angle(std::atan2(to.y(), to.x()) - truth.yaw());
    const SE2 wanted = SE2(0.0, 0.0, turn) * SE2(options.step, 0.0, 0.0);
    const auto move = field_core::OdometryMotion::from(wanted);
    const Eigen::Vector3d variance = motion.variances(move);
    field_core::OdometryMotion noisy = move;
    noisy.rot1 += random.normal(0.0, std::sqrt(variance[0]));
    noisy.trans += random.normal(0.0, std::sqrt(variance[1]));
    noisy.rot2 += random.normal(0.0, std::sqrt(variance[2]));
    truth = truth * noisy.delta();
    const RobotVector robot = online.robot();
    const auto odometry = odometry_step(motion, SE2(robot[0], robot[1], robot[2]), wanted);
    log.move(robot.head<kPose>(), odometry);
    online.move(odometry, 0.0);
    const Eigen::Vector4d m = field(truth.x(), truth.y());
    const double c = std::cos(truth.yaw()), s = std::sin(truth.yaw());
    const double variance_z = options.noise * options.noise;
    Observation<double> z[M];
    for (int i = 0; i < M; i += 2) {
      z[i] = {i, c * m[i] + s * m[i + 1] + 0.03 + random.normal(0.0, options.noise), variance_z};
      z[i + 1] = {i + 1, -s * m[i] + c * m[i + 1] - 0.02 + random.normal(0.0, options.noise),
                  variance_z};
    }
    if (online.observe({}, z, M).applied) {
      log.observe({}, z, M, online);
      poses.push_back(truth);
    }
  }

  void next_goal() {  // corners of rows of 1 m
    const int rows = static_cast<int>(options.side) + 1;
    const int row = leg_ / 2 % (2 * rows);
    const double y = row < rows ? row : 2 * rows - 1 - row;
    const double x = (leg_ + 1) / 2 % 2 == 0 ? options.side : 0.0;
    goal_ = {x + random.uniform(-0.2, 0.2), y + random.uniform(-0.2, 0.2)};
    ++leg_;
  }

  Eigen::Vector2d goal_{0.0, 0.0};
  int leg_ = 0;
};

}  // namespace grid_world
