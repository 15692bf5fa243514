// A belief over the sites of the lattice, the paper's: candidates with weights,
// either kept from step to step or collapsed to one Gaussian (eq. 7).
//
// Candidates are the sites within `candidate_sigmas` of the prediction fused
// with any position observation, a twelfth of a cell added for the rounding to
// sites; what the ring beyond would have weighed is measured. Yaw is a Gaussian
// given the position (its regression on x and y).
//
// A step costs O(K^2) for the transition between K candidates and K
// moment-matched places per field and hyperparameter vector.
#pragma once

#include "field_core/odometry_motion_model.hpp"
#include "gmrf_slap/robot_belief.hpp"
#include "joint_posterior.hpp"
#include "place_mixture.hpp"

namespace gmrf_slap {

class LatticeBelief final : public RobotBelief {
 public:
  LatticeBelief(const GmrfSlapParams& params, const FieldBank& fields);

  void predict(const field_core::SE2& delta) override;
  void displace(const Eigen::Vector2d& motion, const Eigen::Matrix2d& noise) override;
  field_core::UpdateResult observe_position(const FieldBank& fields,
                                            const Eigen::Vector2d& position,
                                            const Eigen::Matrix2d& covariance) override;
  field_core::UpdateResult update(FieldBank& fields, const std::vector<Observation>& observations,
                                  const field_core::SE2& sensor_in_base) override;
  field_core::Belief belief() const override;
  void merge_into(FieldBank&) const override {}
  Eigen::VectorXd field_mean(const FieldMixture& field, std::size_t) const override {
    return field.site_mean();
  }
  Eigen::VectorXd theta_posterior(const FieldMixture& field, std::size_t) const override {
    return field.probability;
  }
  double left_out_mass() const override { return left_out_; }
  double left_out_information() const override { return left_out_information_; }
  void set_pose(const field_core::SE2& mean, const Eigen::Matrix3d& covariance) override;
  void scatter(const FieldBank& fields) override;
  void save(field_core::State& state, const std::string& prefix) const override;
  void restore(const field_core::State& state, const std::string& prefix,
               const FieldBank& fields) override;

 private:
  /// yaw = yaw_ + slope (position - mean_), variance given the position.
  struct YawModel {
    Eigen::RowVector2d slope;
    double variance;
  };
  YawModel yaw_model() const;
  double yaw_at(const Eigen::Vector2d& position, const YawModel& model) const;
  /// An observation of the position; information 0: none.
  struct Fix {
    Eigen::Vector2d position = Eigen::Vector2d::Zero();
    Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  };
  /// New candidates with prior weights; false: none on the grid.
  bool choose_candidates(const Fix& fix);
  /// Eq. (12)-(14): posterior weights of the candidates and of the
  /// hyperparameters, in joint_.
  field_core::UpdateResult weigh(const FieldBank& fields,
                                 const std::vector<Observation>& observations);
  /// Eq. (15)-(17). Returns what was left out, each the most of any field and theta.
  LeftOut assimilate(FieldBank& fields, const std::vector<Observation>& observations);
  double prior_density(const Eigen::Vector2d& site, const Eigen::Matrix2d& information) const;
  void take_moments();

  Lattice lattice_;
  bool collapse_;
  double sigmas_, noise_scale_;
  Thrift thrift_;
  field_core::OdometryMotionModel motion_;
  Eigen::Vector2d mean_ = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_ = Eigen::Matrix2d::Zero();
  double yaw_ = 0.0, yaw_variance_ = 0.0;
  Eigen::RowVector2d yaw_covariance_ = Eigen::RowVector2d::Zero();  ///< with the position
  std::vector<Eigen::Vector2d> places_;  ///< of the candidates, moved with the robot
  Eigen::VectorXd weights_;              ///< empty: the Gaussian alone is known
  Eigen::Matrix2d moved_noise_ = Eigen::Matrix2d::Zero();  ///< since the candidates were chosen
  bool moved_ = true;
  double left_out_ = 0.0, left_out_information_ = 0.0;
  // Kept between steps.
  std::vector<Eigen::Vector2d> sites_;
  std::vector<SiteRow> rows_;
  std::vector<double> chosen_, mean_buffer_, variance_buffer_;
  JointPosterior joint_;
  PlaceMixture mixture_;
};

}  // namespace gmrf_slap
