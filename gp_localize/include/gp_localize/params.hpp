// Every parameter of the estimator: default, range, unit and documentation, in this one place.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "field_core/kernels.hpp"
#include "field_core/motion_params.hpp"
#include "field_core/params.hpp"

namespace gp_localize {

/// One scalar field, modelled as a Gaussian process with constant mean (paper section 2.1).
struct FieldParams {
  std::string unit = "1";
  field_core::KernelType kernel = field_core::KernelType::squared_exponential;
  double mean = 0.0;
  double signal_stddev = 1.0;
  double noise_stddev = 0.1;
  std::vector<double> length_scales = {1.0, 1.0};

  template <class Visitor>
  void visit(Visitor& v) {
    using field_core::KernelType;
    using field_core::positive;
    v.text("unit", unit, "unit of the values, shown on maps");
    v.choice("kernel", kernel,
             {{"squared_exponential", KernelType::squared_exponential},
              {"matern32", KernelType::matern32},
              {"matern52", KernelType::matern52}},
             "covariance function of the field");
    v.required("mean").number("mean", mean, field_core::any_number(), "field unit",
                              "value far from any measurement");
    v.required("signal_stddev")
        .number("signal_stddev", signal_stddev, positive(), "field unit",
                "how much the field varies over the area");
    v.required("noise_stddev")
        .number("noise_stddev", noise_stddev, positive(), "field unit", "noise of one measurement");
    v.required("length_scales")
        .numbers("length_scales", length_scales, {2, 2}, positive(), "m",
                 "distance over which the field changes, along x and y");
  }
};

/// Fields that are correlated (coregionalization.hpp).
struct CoregionalizationParams {
  std::vector<std::string> fields;
  std::vector<double> correlations;

  template <class Visitor>
  void visit(Visitor& v) {
    v.required("fields").texts(
        "fields", fields,
        "the group's fields; they must have one kernel and the same length_scales");
    v.required("correlations")
        .numbers("correlations", correlations, {1, 66}, {-1.0, 1.0}, "1",
                 "between them: the upper triangle of the matrix row by row, 1-2, 1-3, .. 2-3, ..");
  }
  int size() const { return static_cast<int>(fields.size()); }
};

enum class MapHypotheses { sample_paths, particle };
enum class ObservationModelType {
  online_pitc,
  online_pitc_assimilated,
  offline_pitc,
  fitc,
  full_gp,
  sod_truncate,
  sod_even
};
enum class SupportSelection { explicit_points, grid, farthest_point, mutual_information, survey };
enum class Mode { mapping, localization, lifelong };
enum class Precision { single_precision, double_precision };

/// Where the sparse Gaussian process is supported (the set S of the paper).
struct SupportParams {
  SupportSelection selection = SupportSelection::grid;
  int size = 40;
  std::vector<double> region = {-10.0, -10.0, 10.0, 10.0};
  std::vector<Eigen::Vector2d> points;
  int budget = 0;
  double grow_at = 0.5;
  bool noisy = false;
  double jitter = 1e-8;

  template <class Visitor>
  void visit(Visitor& v) {
    v.choice("selection", selection,
             {{"explicit", SupportSelection::explicit_points},
              {"grid", SupportSelection::grid},
              {"farthest_point", SupportSelection::farthest_point},
              {"mutual_information", SupportSelection::mutual_information},
              {"survey", SupportSelection::survey}},
             "how the support points are chosen before the run; survey: spread over its places");
    v.number("size", size, {1, 400}, "1", "how many support points; cost grows with its square");
    v.numbers("region", region, {4, 4}, field_core::any_number(), "m",
              "x_min, y_min, x_max, y_max of the area where the robot may be, in the map frame");
    v.points("points", points, "m", "the support points for selection: explicit");
    v.number("budget", budget, {0, 400}, "1",
             "how many points may be added where the robot leaves what the points cover "
             "(map_hypotheses: particle); they cost as if they were there from the start");
    v.number("grow_at", grow_at, {0.05, 0.95}, "1",
             "a point is added where this share of a field's variance is not explained");
    v.flag(
        "noisy", noisy,
        "true: support values carry measurement noise, as the paper prints it; false: noise-free "
        "(Quinonero-Candela and Rasmussen 2005)");
    v.number("jitter", jitter, {0.0, 1e-2}, "1",
             "added to the diagonal of the support covariance, as a share of the signal variance");
  }
  void validate() const;
};

/// Systematic errors of the odometry, estimated per particle. Not used while odom_alpha1..4 are all
/// 0: odometry is then exact.
struct CalibrationParams {
  double translation_stddev = 0.0;
  double rotation_stddev = 0.0;
  double drift_stddev = 0.0;
  double memory = 1000.0;
  double calibrated_probability = 0.0;

  template <class Visitor>
  void visit(Visitor& v) {
    using field_core::non_negative;
    v.number("translation_stddev", translation_stddev, {0.0, 1.0}, "1",
             "prior of the logarithm of true over reported distance; 0: known to be right");
    v.number("rotation_stddev", rotation_stddev, {0.0, 1.0}, "1",
             "prior of the logarithm of true over reported turn");
    v.number("drift_stddev", drift_stddev, {0.0, 1.0}, "rad/m",
             "prior of the turn per metre that odometry does not see");
    v.number("memory", memory, non_negative(), "m",
             "driven distance over which the calibration wanders through its prior; 0: constant");
    v.number("calibrated_probability", calibrated_probability, {0.0, 1.0}, "1",
             "prior probability that the odometry has no systematic error at all");
  }
};

/// Hyperparameters that are learned during the run: what each may be, as multiples of the
/// configured value. All combinations are candidates, equally likely before the run.
struct CandidateParams {
  std::vector<double> length_scales = {1.0};
  std::vector<double> noise = {1.0};
  std::vector<double> signal = {1.0};
  std::vector<double> survey_correlation = {1.0};
  bool shared = false;

  template <class Visitor>
  void visit(Visitor& v) {
    constexpr field_core::Size kSome{1, 8};
    const field_core::Range range{0.01, 100.0};
    v.numbers("length_scales", length_scales, kSome, range, "1", "of both length_scales");
    v.numbers("noise", noise, kSome, range, "1", "of noise_stddev");
    v.numbers("signal", signal, kSome, range, "1", "of signal_stddev");
    v.numbers("survey_correlation", survey_correlation, kSome, {0.0, 1.0}, "1",
              "of survey_correlation");
    v.flag("shared", shared,
           "true: one candidate for all fields of a particle; false: each field its own");
  }
  std::size_t count() const {
    return length_scales.size() * noise.size() * signal.size() * survey_correlation.size();
  }
};

/// Slow drift of a field's level against a known map.
struct FieldOffsetParams {
  double stddev = 0.0;
  double memory = 600.0;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("stddev", stddev, {0.0, 10.0}, "1",
             "prior of the offset of each field's level, as a share of its signal_stddev; 0: none");
    v.number("memory", memory, field_core::positive(), "s",
             "time over which the offset wanders through its prior");
  }
};

/// How many particles are in use (KLD sampling, Fox 2003).
struct AdaptiveParams {
  int min_particles = 0;
  double kld_err = 0.05;
  double kld_z = 2.33;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("min_particles", min_particles, {0, 100000}, "1",
             "as few particles as this while the pose is well known; 0: always `particles`");
    v.number("kld_err", kld_err, {1e-4, 1.0}, "1",
             "largest distance between the sampled and the true belief, as in amcl");
    v.number("kld_z", kld_z, {0.0, 5.0}, "1",
             "normal quantile of the probability that it is kept: 2.33 is 99 %");
  }
};

/// How many different pasts the particles keep, which is what their maps rest on. Closing a loop
/// chooses among the paths that are left, and no later measurement brings one back; a filter that
/// has used them up is sure of the last one.
struct DiversityParams {
  int paths = 50;
  int horizon = 100;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("paths", paths, {0, 100000}, "1",
             "while fewer different paths than this (or than a quarter of the particles; times the "
             "share of the fields' variance that a map known before the run leaves open) are left, "
             "the likelihood is raised to the power of their share of it; 0: however few");
    v.number("horizon", horizon, {1, 1000000}, "1",
             "paths of this many to twice as many measurements ago are counted: more than the "
             "robot takes to come back to where it was");
  }
};

/// When the filter says that it is lost, and what it does then.
struct HealthParams {
  double nis = 3.0;
  int window = 20;
  double stddev = 5.0;
  double recovery_share = 0.1;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("nis", nis, field_core::positive(), "1",
             "lost: innovations squared per degree of freedom average more than this ...");
    v.number("window", window, {2, 10000}, "1", "... over this many measurements");
    v.number("stddev", stddev, field_core::positive(), "m",
             "lost: the position is less certain than this");
    v.number("recovery_share", recovery_share, {0.0, 0.9}, "1",
             "while measurements contradict a known map, this share of the particles is drawn anew "
             "over the region at each resampling; 0: no recovery");
  }
};

struct GpLocalizeParams : field_core::MotionParams {
  std::map<std::string, FieldParams> fields;
  std::map<std::string, CoregionalizationParams> coregionalization;
  Mode mode = Mode::mapping;
  std::string survey;
  double survey_correlation = 1.0;
  int particles = 400;
  AdaptiveParams adaptive;
  DiversityParams diversity;
  HealthParams lost;
  MapHypotheses map_hypotheses = MapHypotheses::particle;
  int sample_paths = 400;
  int slice_size = 10;
  ObservationModelType observation_model = ObservationModelType::online_pitc;
  int subset_size = 40;
  bool redraw_sample_paths = true;
  double likelihood_noise_scale = 2.0;
  double likelihood_exponent = 1.0;
  double outlier_share = 0.0;
  double resample_threshold = 0.5;
  Precision precision = Precision::single_precision;
  double interpolation_tolerance = 1e-2;
  CandidateParams candidates;
  double variance_dof = 0.0;
  FieldOffsetParams field_offset;
  bool map_error_correlation = true;
  SupportParams support;
  CalibrationParams odom_calibration;

  template <class Visitor>
  void visit(Visitor& v) {
    v.required("fields").dictionary("fields", fields, "the fields to localize by, by name");
    v.dictionary("coregionalization", coregionalization,
                 "groups of correlated fields, by any name: what one of them measures teaches the "
                 "others (learn_hyperparameters --coregionalize); without: all independent");
    v.choice("mode", mode,
             {{"mapping", Mode::mapping},
              {"localization", Mode::localization},
              {"lifelong", Mode::lifelong}},
             "mapping: learn the map; localization: use a known one (survey, or a loaded state) as "
             "it is; lifelong: go on learning a known one");
    v.text("survey", survey,
           "CSV file with x_m, y_m and one column per field that the map starts from; empty: none");
    v.number("survey_correlation", survey_correlation, {0.0, 1.0}, "1",
             "of each field with what it was when the survey was made; 1: the same, less: other "
             "conditions, as light on another day");
    v.number("particles", particles, {1, 100000}, "1", "particles of the filter, or most of them");
    v.group("adaptive", adaptive, "number of particles");
    v.group("diversity", diversity,
            "different paths that the particles' maps rest on (map_hypotheses: particle, modes "
            "mapping and lifelong)");
    v.group("lost", lost, "when the filter is lost, and what it does then");
    v.choice("map_hypotheses", map_hypotheses,
             {{"sample_paths", MapHypotheses::sample_paths}, {"particle", MapHypotheses::particle}},
             "particle: one map per particle, the more accurate; sample_paths: the paper's shared "
             "sample "
             "paths (eq. 9)");
    v.number("sample_paths", sample_paths, {1, 10000}, "1",
             "the paper's C: sample paths of eq. (9)");
    v.number("slice_size", slice_size, {1, 100}, "1", "the paper's tau: measurements per slice");
    v.choice("observation_model", observation_model,
             {{"online_pitc", ObservationModelType::online_pitc},
              {"online_pitc_assimilated", ObservationModelType::online_pitc_assimilated},
              {"offline_pitc", ObservationModelType::offline_pitc},
              {"fitc", ObservationModelType::fitc},
              {"full_gp", ObservationModelType::full_gp},
              {"sod_truncate", ObservationModelType::sod_truncate},
              {"sod_even", ObservationModelType::sod_even}},
             "online_pitc: eq. (12)-(13); online_pitc_assimilated: eq. (10)-(11); the rest: the "
             "paper's baselines");
    v.number("subset_size", subset_size, {1, 10000}, "1",
             "measurements that sod_truncate and sod_even keep (the paper: 10 and 40)");
    v.flag("redraw_sample_paths", redraw_sample_paths,
           "remark 3: once per slice the sample paths continue from poses drawn from the belief");
    v.number(
        "likelihood_noise_scale", likelihood_noise_scale, {1.0, 100.0}, "1",
        "the particles' likelihood uses this many times noise_stddev: real fields are not exactly "
        "the model");
    v.number("likelihood_exponent", likelihood_exponent, {0.01, 1.0}, "1",
             "the particles' likelihood is raised to this power: errors of a real field's model "
             "are alike from one measurement to the next");
    v.number(
        "outlier_share", outlier_share, {0.0, 0.5}, "1",
        "this share of the measurements may be anything within the field's spread (map_hypotheses: "
        "particle only)");
    v.number("resample_threshold", resample_threshold, {0.0, 1.0}, "1",
             "resample when the effective sample size falls below this share of the particles");
    v.choice("precision", precision,
             {{"single", Precision::single_precision}, {"double", Precision::double_precision}},
             "arithmetic of the likelihood of particles x paths; the map itself is always double");
    v.number(
        "interpolation_tolerance", interpolation_tolerance, {0.0, 0.1}, "1",
        "particles close together share evaluations of the paths' maps while that errs by less "
        "than this share of the measurement noise; 0: never");
    v.group("candidates", candidates,
            "hyperparameters learned during the run: each particle tries one combination of these "
            "multiples per field (map_hypotheses: particle, mode: mapping)");
    v.number(
        "variance_dof", variance_dof, {0.0, 1e6}, "1",
        "signal_stddev and noise_stddev of each field are right up to a common factor, which is "
        "learned: the configured values count as much as this many measurements; 0: they are "
        "right (map_hypotheses: particle)");
    v.group("field_offset", field_offset,
            "drift of the fields against their known maps, estimated (mode: localization)");
    v.flag(
        "map_error_correlation", map_error_correlation,
        "mode localization: what the map leaves open of a field is alike from one reading to the "
        "next, so that the less the map knows and the closer readings are, the less each counts; "
        "false: every reading is independent evidence");
    v.group("support", support, "support points of the sparse Gaussian process");
    visit_odometry_noise(v);
    v.group("odom_calibration", odom_calibration, "systematic errors of the odometry, estimated");
    visit_start_and_updates(v);
  }
  void validate() const;
  /// Rules of the groups; part of validate().
  void validate_coregionalization() const;
  bool known_map() const { return mode != Mode::mapping; }
};

}  // namespace gp_localize
