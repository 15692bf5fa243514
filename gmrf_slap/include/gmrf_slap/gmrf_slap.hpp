// The estimator that nodes and replays run: Slap in the words of field_core/estimator.hpp.
#pragma once

#include <cstdint>
#include <vector>

#include "field_core/estimator.hpp"
#include "gmrf_slap/params.hpp"
#include "gmrf_slap/slap.hpp"

namespace gmrf_slap {

/// Several robots, which share the fields; observations of their positions.
class GmrfSlap {
 public:
  using Params = GmrfSlapParams;
  static constexpr const char* kName = "gmrf_slap";
  static constexpr std::uint32_t kStateVersion = 1;

  GmrfSlap(const Params& params, std::uint64_t seed)
      : robots_(params.robots), slap_(params, seed) {}

  const std::vector<std::string>& robots() const { return robots_; }
  void set_obstacles(const field_core::OccupancyMask& mask) {
    slap_.set_walls(walls_from(slap_.bank().lattice(), mask));
  }
  void predict(const field_core::OdometryIncrement& increment, int robot = 0) {
    slap_.predict(robot, increment);
  }
  field_core::UpdateResult update(const field_core::Sample& sample, int robot = 0) {
    return slap_.update(robot, sample);
  }
  field_core::UpdateResult observe_position(const field_core::PositionObservation& seen,
                                            int robot = 0) {
    return slap_.observe_position(robot, seen.position, seen.covariance);
  }
  field_core::Belief belief(int robot = 0) const { return slap_.belief(robot); }
  field_core::FieldPrediction predict_field(const Eigen::Matrix2Xd& points) const {
    return slap_.predict_field(points);
  }
  std::vector<field_core::HyperparameterPosterior> hyperparameters() const {
    return slap_.hyperparameters();
  }
  /// What a state does not depend on.
  static std::vector<std::string> run_parameters() {
    return {"resample_threshold", "likelihood_noise_scale",
            "candidate_sigmas",   "prune_mass",
            "merge_loss",         "memory_limit",
            "position_stddev",    "robot_models",
            "odom_alpha1",        "odom_alpha2",
            "odom_alpha3",        "odom_alpha4",
            "initial_pose_x",     "initial_pose_y",
            "initial_pose_a",     "initial_cov_xx",
            "initial_cov_yy",     "initial_cov_aa",
            "update_min_d",       "update_min_a"};
  }
  const std::vector<field_core::FieldInfo>& fields() const { return slap_.fields(); }
  field_core::MapRegion map_region() const { return slap_.map_region(); }
  void set_pose(const field_core::SE2& mean, const Eigen::Matrix3d& covariance, int robot = 0) {
    slap_.set_pose(robot, mean, covariance);
  }
  void scatter(int robot = 0) { slap_.scatter(robot); }
  void reset() { slap_.reset(); }
  field_core::State state() const {
    field_core::State state(kName, kStateVersion);
    slap_.save(state);
    return state;
  }
  void restore(const field_core::State& state) {
    state.require(kName, kStateVersion);
    slap_.restore(state);
  }

  Slap& slap() { return slap_; }
  const Slap& slap() const { return slap_; }

 private:
  std::vector<std::string> robots_;
  Slap slap_;
};

static_assert(field_core::is_estimator_v<GmrfSlap> &&
              field_core::detail::HasRobots<GmrfSlap>::value &&
              field_core::detail::HasPositions<GmrfSlap>::value &&
              field_core::detail::HasObstacles<GmrfSlap>::value);

}  // namespace gmrf_slap
