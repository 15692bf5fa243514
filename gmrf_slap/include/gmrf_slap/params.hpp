// Every parameter of the estimator: default, range, unit and documentation, in this one place.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "field_core/motion_params.hpp"
#include "field_core/params.hpp"
#include "gmrf_slap/field_prior.hpp"

namespace gmrf_slap {

enum class Engine { dense, sparse, local };
enum class PositionBelief { trajectories, lattice, gaussian };

/// The lattice that carries the fields.
struct GridParams {
  std::vector<double> origin = {-15.0, -15.0};
  double spacing = 1.0;
  std::vector<double> size = {31.0, 31.0};
  bool wrap = false;
  Boundary boundary = Boundary::corrected;
  Interpolation interpolation = Interpolation::bilinear;

  template <class Visitor>
  void visit(Visitor& v) {
    v.numbers("origin", origin, {2, 2}, field_core::any_number(), "m",
              "first site [x, y] in the map frame");
    v.number(
        "spacing", spacing, field_core::positive(), "m",
        "distance of neighbouring sites; half the distance over which a field changes is fine");
    v.numbers("size", size, {2, 2}, {1.0, 100000.0}, "1", "sites along x and y");
    v.flag("wrap", wrap, "true: opposite edges are neighbours, as in the paper's simulation");
    v.choice("boundary", boundary, {{"corrected", Boundary::corrected}, {"free", Boundary::free}},
             "corrected: the same prior variance everywhere; free: larger near edges and walls");
    v.choice("interpolation", interpolation,
             {{"bilinear", Interpolation::bilinear}, {"nearest", Interpolation::nearest}},
             "the field between sites; nearest: that of the nearest site, as in the paper");
  }
  void validate() const;
};

/// One hyperparameter vector theta: either kappa and alpha (the paper, lattice units), or bandwidth
/// and stddev.
struct HyperparameterParams {
  double kappa = 0.0, alpha = 0.0;
  double bandwidth = 0.0, stddev = 0.0;
  int order = 2;
  double prior = 1.0;

  template <class Visitor>
  void visit(Visitor& v) {
    using field_core::non_negative;
    v.number("kappa", kappa, non_negative(), "1/field unit^2", "the paper's kappa; 0: not given");
    v.number("alpha", alpha, non_negative(), "1", "the paper's alpha; 0: not given");
    v.number("bandwidth", bandwidth, non_negative(), "m",
             "instead of alpha: sqrt(2 / alpha) spacings; correlation 0.14 at twice this distance");
    v.number("stddev", stddev, non_negative(), "field unit",
             "instead of kappa: standard deviation of the field");
    v.number("order", order, {1, 2}, "1", "order of the field's operator; 1: rougher");
    v.number("prior", prior, field_core::positive(), "1",
             "prior probability, up to a factor common to all");
  }
  void validate() const;
};

struct FieldParams {
  std::string unit = "1";
  double mean = 0.0;
  std::vector<double> trend = {0.0, 0.0};
  double measurement_stddev = 0.0;
  double nugget_stddev = 0.0;
  std::vector<HyperparameterParams> hyperparameters;

  template <class Visitor>
  void visit(Visitor& v) {
    using field_core::any_number;
    using field_core::non_negative;
    v.text("unit", unit, "unit of the values, shown on maps");
    v.number("mean", mean, any_number(), "field unit",
             "value far from any measurement, at the origin of the map frame if there is a trend");
    v.numbers("trend", trend, {2, 2}, any_number(), "field unit/m", "slope of the mean");
    v.number("measurement_stddev", measurement_stddev, non_negative(), "field unit",
             "noise of one measurement; 0: the common measurement_stddev");
    v.number("nugget_stddev", nugget_stddev, non_negative(), "field unit",
             "what the field does between sites beyond the lattice's resolution");
    v.list("hyperparameters", hyperparameters, "of this field; []: the common hyperparameters");
  }
  void validate() const;
};

/// One robot's sensor of one field.
struct RobotFieldParams {
  double measurement_stddev = 0.0;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("measurement_stddev", measurement_stddev, field_core::non_negative(), "field unit",
             "noise of this robot's measurements; 0: the field's");
  }
};

/// What one robot has of its own, instead of what is common to all.
struct RobotModelParams {
  std::vector<double> initial_pose, initial_variance, odom_alpha;
  double position_stddev = 0.0;
  std::map<std::string, RobotFieldParams> fields;

  template <class Visitor>
  void visit(Visitor& v) {
    using field_core::non_negative;
    v.numbers("initial_pose", initial_pose, {0, 3}, field_core::any_number(), "m, m, rad",
              "start [x, y, yaw] in the map frame; []: the common initial_pose_*");
    v.numbers("initial_variance", initial_variance, {0, 3}, non_negative(), "m^2, m^2, rad^2",
              "variances of the start; []: the common initial_cov_*");
    v.numbers("odom_alpha", odom_alpha, {0, 4}, non_negative(), "as odom_alpha1..4",
              "odometry noise [alpha1, alpha2, alpha3, alpha4]; []: the common odom_alpha*");
    v.number("position_stddev", position_stddev, non_negative(), "m",
             "noise of its position observations; 0: the common position_stddev");
    v.dictionary("fields", fields, "its sensors, by the name of the field");
  }
  void validate() const;
};

struct GmrfSlapParams : field_core::MotionParams {
  std::map<std::string, FieldParams> fields;
  GridParams grid;
  std::vector<HyperparameterParams> hyperparameters;
  double measurement_stddev = 0.1;
  double position_stddev = 10.0;
  Engine engine = Engine::dense;
  std::vector<std::string> robots = {"robot1"};
  std::map<std::string, RobotModelParams> robot_models;
  PositionBelief position_belief = PositionBelief::trajectories;
  int particles = 200;
  int lag = 60;
  double resample_threshold = 0.5;
  double likelihood_noise_scale = 1.0;
  double candidate_sigmas = 4.0;
  double prune_mass = 1e-4;
  double merge_loss = 3e-4;
  int memory_limit = 4000;

  template <class Visitor>
  void visit(Visitor& v) {
    using field_core::positive;
    v.required("fields").dictionary("fields", fields, "the fields to localize by, by name");
    v.group("grid", grid, "the lattice of the fields");
    v.list("hyperparameters", hyperparameters,
           "the hyperparameter vectors that fields may have, the paper's Theta");
    v.number("measurement_stddev", measurement_stddev, positive(), "field unit",
             "noise of one measurement, of fields that do not set their own");
    v.number("position_stddev", position_stddev, positive(), "m",
             "noise of a position observation that brings no covariance");
    v.choice("engine", engine,
             {{"dense", Engine::dense}, {"sparse", Engine::sparse}, {"local", Engine::local}},
             "dense: small grids; sparse: large grids; local: cost independent of the grid");
    v.texts("robots", robots, "names of the robots that share the fields");
    v.dictionary("robot_models", robot_models,
                 "starts, odometry and sensors that differ between robots, by the robot's name");
    v.choice("position_belief", position_belief,
             {{"trajectories", PositionBelief::trajectories},
              {"lattice", PositionBelief::lattice},
              {"gaussian", PositionBelief::gaussian}},
             "trajectories: particles over the last `lag` measurements; lattice: weights on sites; "
             "gaussian: the paper's, collapsed to one Gaussian after each step (eq. 7)");
    v.number("particles", particles, {1, 100000}, "1", "trajectories of each robot");
    v.number(
        "lag", lag, {1, 1000}, "1",
        "measurements after which a trajectory is merged into the fields; step cost grows with "
        "its square");
    v.number("resample_threshold", resample_threshold, {0.0, 1.0}, "1",
             "resample when the effective sample size falls below this share of the particles");
    v.number("likelihood_noise_scale", likelihood_noise_scale, {1.0, 100.0}, "1",
             "positions are weighed with this many times the measurement noise: real fields are "
             "not exactly the model");
    v.number("candidate_sigmas", candidate_sigmas, {1.0, 10.0}, "1",
             "lattice, gaussian: candidate sites lie within this many standard deviations");
    v.number("prune_mass", prune_mass, {0.0, 0.1}, "1",
             "posterior mass of candidates that may be left out of the field's update");
    v.number("merge_loss", merge_loss, {0.0, 0.1}, "1",
             "lattice, gaussian: similar candidates enter the field's covariance together, each "
             "group for at most this share of any variance; 0: each on its own, exact");
    v.number("memory_limit", memory_limit, {1, 1000000}, "MB",
             "a configuration that needs more is refused");
    visit_odometry_noise(v);
    visit_start_and_updates(v);
  }
  void validate() const;
  /// These parameters with what the robot has of its own in the place of what is common.
  GmrfSlapParams of_robot(const std::string& robot) const;
  /// Noise of a measurement. [field unit]
  double measurement_stddev_of(const FieldParams& field) const {
    return field.measurement_stddev > 0.0 ? field.measurement_stddev : measurement_stddev;
  }
};

}  // namespace gmrf_slap
