// One map per particle (Rao-Blackwellization): each particle carries the online sparse Gaussian
// processes of its own past path, so that evidence weighs paths, not only places. What closed
// slices say is shared by all particles with the same ancestor at the last slice's end; an open
// slice is each particle's own.
#pragma once

#include <cmath>
#include <vector>

#include "field_offsets.hpp"
#include "gp_localize/map_model.hpp"
#include "gp_localize/online_sparse_gp.hpp"
#include "map_error.hpp"
#include "variance_factors.hpp"

namespace gp_localize {

/// A step costs O(P F m^2), for P particles and F fields; in a group of q correlated fields
/// O(P q (q m)^2).
class ParticleMap : public MapModel {
 public:
  ParticleMap(const GpLocalizeParams& params, const std::vector<FieldModel>& fields);

  void restart(const field_core::SE2& pose, const Eigen::Matrix3d& covariance,
               const MotionModel& model, field_core::Random& random) override;
  void relocate(const ParticleSet& particles, field_core::Random& random) override;
  void move(const field_core::OdometryMotion& motion, const MotionModel&,
            field_core::Random&) override {
    map_error_.move(std::abs(motion.trans));
  }
  void weigh(const ParticleSet& particles, const field_core::SE2& sensor_in_base,
             const std::vector<Observation>& observations, std::vector<double>& log_likelihood,
             Innovation& innovation) override;
  void accept(const std::vector<Observation>& observations) override;
  double unknown(const ParticleSet& particles,
                 const std::vector<Observation>& observations) const override;
  void keep_as_known() override;
  void learn(const ParticleSet& particles, const field_core::SE2& sensor_in_base,
             const std::vector<Observation>& observations, field_core::Random& random) override;
  void resampled(const std::vector<int>& ancestors) override;
  FieldVariances variances(int field, const ParticleSet& particles) const override;
  void predict(int field, const Eigen::Matrix2Xd& points, const ParticleSet& particles,
               Eigen::VectorXd& mean, Eigen::VectorXd& variance) const override;
  Eigen::Matrix2Xd grown_support() const override;
  std::vector<field_core::HyperparameterPosterior> hyperparameters(
      const ParticleSet& particles) const override;
  void save(field_core::State& state) const override;
  void restore(const field_core::State& state, const std::vector<int>& ancestors) override;

  int distinct_maps() const { return static_cast<int>(closed_.size() - free_.size()); }

 private:
  using Closed = std::vector<SupportPosterior>;  // one per group
  using Slices = std::vector<OpenSlice>;         // one per group

  Evaluation& evaluation(int field, std::size_t particle) {
    return evaluations_[field * closed_.size() + particle];
  }
  /// The candidate that a particle tries for a field.
  const FieldModel& model(std::size_t particle, int field) const {
    return candidates_[field][candidate_[particle * first_.size() + fields_[field].group]];
  }
  /// Measurement noise under the particle's candidate, over that of the configured model.
  double noise_ratio(std::size_t particle, int field) const {
    return model(particle, field).noise_variance / fields_[field].noise_variance;
  }
  double* joint_row(std::size_t particle, int field) {
    return joint_.data() + (particle * fields_.size() + field) * (fields_.size() + 1);
  }
  void condition_on_partners(std::size_t particle, const Observation& o, double& mean,
                             double& variance);
  void draw_candidates(field_core::Random& random);
  /// The particles that try candidate c of a field, into members_.
  void find_members(int field, int c, std::size_t count) const;
  double factor(std::size_t particle, int field) const {
    return factors_.factor(particle, fields_[field].group);
  }
  enum class Moments { all, about_zero };
  Eigen::Matrix2Xd predict_members(int field, int c, const Eigen::Matrix2Xd& points,
                                   const std::vector<double>& weights, Moments which) const;
  void grow_support(const ParticleSet& particles);
  void forget_grown_support();
  void grow_all(const Eigen::Vector2d& place);
  void compute_features(int field, std::size_t count);
  void share_among_all(std::size_t particles);
  /// Every particle with the map of its candidates before the run: a copy each, if they differ.
  void start_from_initial();
  double log_density(double error, double variance, double signal_variance) const;
  void close_slices();
  /// A map that the particle alone may write to; what it held is left to the caller.
  int own_map(std::size_t particle);
  void recount_users();

  std::vector<FieldModel> fields_;
  std::vector<int> first_;                           // first field of each group
  std::vector<std::vector<FieldModel>> candidates_;  // [field][candidate]
  bool shared_candidate_;
  double grow_at_;
  Eigen::Index first_support_;                  // number of points before any was added
  std::vector<int> candidate_, new_candidate_;  // [particle * groups + group]
  int slice_size_;                              // steps
  Recent recent_;
  double outlier_share_;
  int steps_in_slice_ = 0;
  FieldOffsets offsets_;
  VarianceFactors factors_;
  MapError map_error_;
  std::vector<Closed> initial_;  // [candidate]: the prior, or what the survey says under it
  bool surveyed_;
  std::vector<Closed> known_;  // one saved map that the run began with, or none
  // As many of each as there may be particles; map_[p] and slice_[p] are particle p's, users_[i]
  // how many particles map i has. Maps may be shared, slices are not.
  std::vector<Closed> closed_;
  std::vector<Slices> slices_;
  std::vector<int> map_, slice_, users_, free_;
  // Kept between steps; weigh() leaves in evaluations_ what learn() goes on with.
  std::vector<Evaluation> evaluations_;  // [field * most particles + particle]
  std::vector<double> features_, density_;
  std::vector<Eigen::MatrixXd> phi_;  // [field]: m x P, by columns
  Places points_, gathered_;
  // Where fields are correlated, a step's readings in one Gaussian: per particle and field the row
  // of the Cholesky factor (1 / the pivot on its diagonal), and the whitened error at its end.
  std::vector<double> joint_;
  std::vector<std::vector<int>> weighed_;  // [group]: the step's fields so far
  mutable std::vector<std::size_t> members_;
  mutable std::vector<double> gain_;  // A phi of a known map
  std::vector<int> new_map_, new_slice_, spare_slices_;
  std::vector<char> kept_;
};

}  // namespace gp_localize
