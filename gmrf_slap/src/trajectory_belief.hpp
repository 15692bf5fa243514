// A belief over trajectories instead of positions: particles that each remember where the last
// `lag` measurements were taken.
//
// The paper folds every measurement into the fields at once, over all places where it may have been
// taken; what is learned later about that place comes too late. Here a particle is a trajectory
// with its own exact regression on the last measurements (SuffixProcess) above the shared fields.
// Weights are exact given the trajectory, hyperparameters are summed out per particle. When `lag`
// measurements are held, the oldest quarter goes into the shared fields by moment matching (eq.
// 15-17), with the weights of today: smoothed over the lag. Lag 1 is close to the paper.
//
// A step costs O(P L F lag^2 / 2), whatever came before, and every lag / 4 measurements
// O(P L F lag^3 / 16) and a few moment matchings.
#pragma once

#include "field_core/odometry_motion_model.hpp"
#include "field_core/random.hpp"
#include "gmrf_slap/robot_belief.hpp"
#include "place_mixture.hpp"
#include "suffix_process.hpp"
#include "weights.hpp"

namespace gmrf_slap {

class TrajectoryBelief final : public RobotBelief {
 public:
  TrajectoryBelief(const GmrfSlapParams& params, const FieldBank& fields, std::uint64_t seed);

  void predict(const field_core::SE2& delta) override;
  void displace(const Eigen::Vector2d& motion, const Eigen::Matrix2d& noise) override;
  field_core::UpdateResult observe_position(const FieldBank& fields,
                                            const Eigen::Vector2d& position,
                                            const Eigen::Matrix2d& covariance) override;
  field_core::UpdateResult update(FieldBank& fields, const std::vector<Observation>& observations,
                                  const field_core::SE2& sensor_in_base) override;
  field_core::Belief belief() const override { return belief_; }
  void merge_into(FieldBank& fields) const override;
  Eigen::VectorXd field_mean(const FieldMixture& field, std::size_t index) const override;
  Eigen::VectorXd theta_posterior(const FieldMixture& field, std::size_t index) const override;
  double left_out_mass() const override { return 0.0; }
  void set_pose(const field_core::SE2& mean, const Eigen::Matrix3d& covariance) override;
  void scatter(const FieldBank& fields) override;
  void save(field_core::State& state, const std::string& prefix) const override;
  void restore(const field_core::State& state, const std::string& prefix,
               const FieldBank& fields) override;

 private:
  using Track = std::vector<SuffixProcess>;  // per field

  void summarize();
  void normalize_weights();
  void resample_if_needed();
  void follow(const FieldBank& fields);
  void append(const FieldBank& fields, const std::vector<Observation>& observations);
  /// All sites of the trajectories and of `rows`.
  void focus(FieldBank& fields, const std::vector<SiteRow>& rows) const;
  void merge_oldest(FieldBank& fields, int field, int entry) const;
  /// Brings the oldest `steps` measurements into the fields, with the weights of now.
  void merge(FieldBank& fields, int steps) const;
  void advance(FieldBank& fields);
  /// pi(theta | D, trajectory of p).
  const Eigen::VectorXd& hypotheses_of(const FieldMixture& field, std::size_t f,
                                       std::size_t p) const;

  std::size_t count_;
  int lag_, sites_;
  double resample_threshold_, noise_scale_, prune_mass_;
  field_core::OdometryMotionModel motion_;
  field_core::Random random_;
  std::vector<field_core::SE2> poses_;
  Eigen::VectorXd log_weights_, weights_;
  std::vector<Track> tracks_;
  std::vector<std::vector<unsigned char>> steps_;  // which fields each held measurement had
  std::size_t held_ = 0;                           // of steps_; the rest is kept for later
  std::size_t version_ = 0;                        // of the fields that the tracks follow
  field_core::Belief belief_;
  // Kept between steps so that a step allocates nothing.
  std::vector<SiteRow> rows_;
  std::vector<Eigen::Vector2d> places_;
  std::vector<int> ancestors_;
  mutable std::vector<Eigen::VectorXd>
      theta_;  // per field: pi(theta | trajectory) of the last asked
  mutable std::vector<Eigen::MatrixXd>
      shares_;  // per field: the same of all, hypotheses x particles
  mutable PlaceMixture mixture_;
  std::vector<double> before_;
  std::vector<LogSum> ratio_;
};

}  // namespace gmrf_slap
