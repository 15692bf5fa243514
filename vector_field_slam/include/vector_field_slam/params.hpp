// Every parameter of the estimator: default, range, unit and documentation, in this one place.
#pragma once

#include <map>
#include <string>

#include "field_core/motion_params.hpp"
#include "field_core/params.hpp"
#include "vector_field_slam/eseif_config.hpp"

namespace vector_field_slam {

/// One signal. Its kind follows from sensor_model and, for vectors, from the end of its name.
struct ChannelParams {
  std::string unit = "1";
  double noise_stddev = 0.1;
  double interpolation_stddev = 0.0;
  double prior_stddev = 0.0;
  double extrapolation_stddev = 0.0;

  template <class Visitor>
  void visit(Visitor& v) {
    using field_core::non_negative;
    v.text("unit", unit, "unit of the values, shown on maps");
    v.required("noise_stddev")
        .number("noise_stddev", noise_stddev, field_core::positive(), "channel unit",
                "of one measurement; a variance in the message replaces it");
    v.number("interpolation_stddev", interpolation_stddev, non_negative(), "channel unit",
             "by which the field differs from the straight surface between the nodes of a cell; "
             "always added to the noise. Too small, and the filter is over-confident");
    v.number("prior_stddev", prior_stddev, non_negative(), "node unit",
             "of a node's value before any measurement (eq. 13); 0: 10 times noise_stddev. The "
             "node unit is the channel's, but m^2 for sensor_model: range");
    v.number("extrapolation_stddev", extrapolation_stddev, non_negative(), "node unit",
             "by which a new node may differ from its extrapolation (S of eq. 14); 0: half of "
             "prior_stddev");
  }
};

enum class SolverType { ekf, eseif, batch };
enum class SensorModelType { beacon_pairs, scalar, magnetic, range };

struct VectorFieldSlamParams : field_core::MotionParams {
  /// The start fixes the map frame: it is known to a centimetre unless said.
  VectorFieldSlamParams() { initial_cov_xx = initial_cov_yy = initial_cov_aa = 1e-4; }

  double cell_size = 1.0;
  SolverType solver = SolverType::eseif;
  SensorModelType sensor_model = SensorModelType::scalar;
  std::map<std::string, ChannelParams> channels;
  int start_measurements = 10;
  double gate_probability = 0.9999;
  double underweighting = 0.0;
  double calibration_stddev = 0.05;
  double calibration_noise = 0.0;
  Relocation relocation = Relocation::window;
  double relocation_stddev_xy = 0.05, relocation_stddev_a = 0.05;
  double relocation_stddev_calibration = 0.01;
  int recovery_rings = 1;
  int background_period = 0, background_delay = 20, background_poses = 4000;
  int max_nodes = 4096;
  bool localize_only = false;
  int patience = 10;
  int relocalization_particles = 3000;
  double max_speed = 5.0, max_turn_rate = 10.0;

  template <class Visitor>
  void visit(Visitor& v) {
    visit_model(v);
    visit_solver(v);
    visit_motion(v);
  }
  void validate() const;  ///< @throws field_core::ParameterError

 private:
  template <class Visitor>
  void visit_model(Visitor& v) {
    v.number("cell_size", cell_size, field_core::positive(), "m", "distance between nodes");
    v.choice("solver", solver,
             {{"ekf", SolverType::ekf}, {"eseif", SolverType::eseif}, {"batch", SolverType::batch}},
             "ekf: full covariance, cost grows with the square of the map; eseif: exactly sparse "
             "information filter, constant time; batch: eseif, corrected by least squares over the "
             "whole run");
    v.choice("sensor_model", sensor_model,
             {{"beacon_pairs", SensorModelType::beacon_pairs},
              {"scalar", SensorModelType::scalar},
              {"magnetic", SensorModelType::magnetic},
              {"range", SensorModelType::range}},
             "beacon_pairs: channels SPOT_x, SPOT_y turn with the robot (eq. 47); magnetic: "
             "NAME_x, NAME_y turn, others not; scalar: none turns; range: distances to beacons "
             "[m]");
    v.required("channels")
        .dictionary("channels", channels, "the signals to localize by, by name; at most 8");
    v.number("start_measurements", start_measurements, {1, 64}, "1",
             "measurements that give the linear field around the start (eq. 12)");
    v.number(
        "gate_probability", gate_probability, {0.5, 1.0}, "1",
        "a reading is left out if its innovation is larger than this share of all; 1: none is");
  }

  template <class Visitor>
  void visit_solver(Visitor& v) {
    using field_core::non_negative;
    v.number(
        "underweighting", underweighting, non_negative(), "1",
        "ekf, eseif: factor of the variance that the linearization of a reading leaves out, "
        "added to its noise; 0: none. With 4 long ways through the unknown stay consistent, but "
        "much is given away where the field bends within a cell");
    v.number("calibration_stddev", calibration_stddev, field_core::positive(), "channel unit",
             "of the sensor's offset c before any measurement (eq. 46)");
    v.number("calibration_noise", calibration_noise, non_negative(), "channel unit/sqrt(m)",
             "random walk of the offset over the first metre");
    v.choice(
        "relocation", relocation,
        {{"window", Relocation::window},
         {"shared_nodes", Relocation::shared_nodes},
         {"blank", Relocation::blank}},
        "eseif on a cell change. window: robot and new nodes keep their dependence on the nodes "
        "of the new cell; shared_nodes: the robot keeps its dependence on the nodes that both "
        "cells share; blank: the paper's, independent of the map with the prior of eq. (42)");
    v.number("relocation_stddev_xy", relocation_stddev_xy, non_negative(), "m",
             "R0 of eq. (42), for relocation: blank");
    v.number("relocation_stddev_a", relocation_stddev_a, non_negative(), "rad", "the same for yaw");
    v.number("relocation_stddev_calibration", relocation_stddev_calibration, non_negative(),
             "channel unit", "the same for the offset c");
    v.number("recovery_rings", recovery_rings, {0, 2}, "1",
             "eseif: rings of nodes around the cell whose mean is recovered with it (eq. 39); the "
             "paper: 0");
    v.number("background_period", background_period, {0, 100000}, "1",
             "eseif: samples between optimizations of the whole run by a thread in the background; "
             "0: none. batch: between those at once; 0: 50");
    v.number("background_delay", background_delay, {1, 100000}, "1",
             "samples after which such a result corrects the filter, at most background_period; "
             "long enough for the machine, or the live node takes it later than the replay");
    v.number("background_poses", background_poses, {100, 1000000}, "1",
             "runs with more samples are optimized no more");
    v.number("max_nodes", max_nodes, {4, 1000000}, "1",
             "of the map; a cell that would need more is not entered");
    v.flag("localize_only", localize_only, "the map is taken as it is (~load_state), not changed");
    v.number("patience", patience, {1, 1000000}, "1",
             "after so many measurements in a row outside the gate (or off the known map, once two "
             "standard deviations of the position are a cell) the robot is lost: on a known map "
             "(localize_only) it is searched for as after global_localization, else each further "
             "one widens the pose's covariance");
    v.number("relocalization_particles", relocalization_particles, {100, 1000000}, "1",
             "that search the map for the robot after global_localization");
  }

  template <class Visitor>
  void visit_motion(Visitor& v) {
    visit_odometry_noise(v);
    v.number("max_speed", max_speed, field_core::positive(), "m/s",
             "odometry that jumps faster than this is not believed: the robot is then taken to be "
             "anywhere that it could have driven to");
    v.number("max_turn_rate", max_turn_rate, field_core::positive(), "rad/s", "the same for turns");
    visit_start_and_updates(v);
  }
};

}  // namespace vector_field_slam
