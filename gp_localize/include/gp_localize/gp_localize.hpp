// GP-Localize (Xu, Low, Chen, Lim, Ozgul, AAAI 2014): Monte Carlo localization by scalar fields
// whose maps, Gaussian processes, are learned during the run.
//
// Each measurement weighs the particles by eq. (9), the mean over C hypotheses of the robot's past
// path of the density that the online sparse Gaussian process along that path predicts (eq. 10-13);
// over several fields densities multiply per path before the mean is taken, since a path is one
// hypothesis for all fields; correlated fields (coregionalization.hpp) are weighed by their joint
// density. The measurement then extends every path's map.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "field_core/estimator.hpp"
#include "field_core/random.hpp"
#include "gp_localize/health_monitor.hpp"
#include "gp_localize/kld_sampling.hpp"
#include "gp_localize/lineage.hpp"
#include "gp_localize/map_model.hpp"
#include "gp_localize/params.hpp"

namespace gp_localize {

/// Meets the requirements of field_core/estimator.hpp. Per update O(P C m^2) for P particles, C
/// sample paths and m support points, whatever came before; memory O(C m^2).
class GpLocalize {
 public:
  using Params = GpLocalizeParams;
  static constexpr const char* kName = "gp_localize";
  static constexpr std::uint32_t kStateVersion = 6;

  GpLocalize(const Params& params, std::uint64_t seed);
  GpLocalize(const GpLocalize&) = delete;  // the map refers to the models kept here
  GpLocalize& operator=(const GpLocalize&) = delete;

  void predict(const field_core::OdometryIncrement& increment);
  /// Skips: "no known field", "not moved enough" (update_min_d, update_min_a), "no particle
  /// explains the measurement".
  field_core::UpdateResult update(const field_core::Sample& sample);

  field_core::Belief belief() const;
  /// Lost: innovations contradict the map over a window, or the position is too uncertain. Paths
  /// are counted where each particle learns a map.
  field_core::Health health() const;
  /// Mean calibration of the odometry over the particles.
  OdometryCalibration calibration() const;
  /// Of each field, where `candidates` are tried; empty otherwise.
  std::vector<field_core::HyperparameterPosterior> hyperparameters() const {
    return map_->hyperparameters(particles_);
  }
  field_core::FieldPrediction predict_field(const Eigen::Matrix2Xd& points) const;
  const std::vector<field_core::FieldInfo>& fields() const { return infos_; }
  field_core::MapRegion map_region() const;

  void set_pose(const field_core::SE2& mean, const Eigen::Matrix3d& covariance);
  void scatter();
  void reset();

  field_core::State state() const;
  /// In modes localization and lifelong, a state saved while mapping gives its map only: the pose
  /// is that of the parameters, as after reset(). Every other state is taken over bit for bit.
  void restore(const field_core::State& state);
  /// How the filter is run, not what the map is; the number of particles restore() checks itself.
  static std::vector<std::string> run_parameters() {
    return {"mode",
            "survey",
            "survey_correlation",
            "particles",
            "adaptive",
            "diversity",
            "lost",
            "field_offset",
            "map_error_correlation",
            "likelihood_noise_scale",
            "likelihood_exponent",
            "outlier_share",
            "precision",
            "resample_threshold",
            "interpolation_tolerance"};
  }

 private:
  void reserve();
  bool moved_enough() const;
  /// Each particle's map is learned along its own path.
  bool rests_on_paths() const {
    return params_.map_hypotheses == MapHypotheses::particle && params_.mode != Mode::localization;
  }
  void collect_observations(const field_core::Sample& sample);
  field_core::UpdateResult normalized_innovation() const;
  void resample_if_needed();
  void choose_ancestors();
  void become_children();
  void draw_start();
  void scatter(Particle& particle);
  void restore_map(const field_core::State& state);
  void summarize();

  Params params_;
  std::uint64_t seed_;
  field_core::Random random_;
  MotionModel motion_model_;
  std::vector<FieldModel> models_;
  std::vector<field_core::FieldInfo> infos_;
  std::unique_ptr<MapModel> map_;
  HealthMonitor health_;
  Lineage lineage_;
  PoseBins bins_;
  ParticleSet particles_;
  std::vector<field_core::WeightedPose> weighted_poses_;  // of particles_ before resampling
  field_core::Stamp stamp_{0};
  bool updated_ =
      false;  // since the start: the first measurement is used wherever the robot stands
  double moved_distance_ = 0.0, moved_angle_ = 0.0;  // since the last update
  field_core::SE2 mean_;
  Eigen::Matrix3d covariance_;
  // Kept between steps so that a step allocates nothing.
  std::vector<Observation> observations_;
  std::vector<double> log_weights_;
  std::vector<int> ancestors_;
  std::vector<field_core::SE2> poses_;
  std::vector<double> cumulative_;
  ParticleSet resampled_;
  Innovation innovation_;
};

static_assert(field_core::is_estimator_v<GpLocalize>);

}  // namespace gp_localize
