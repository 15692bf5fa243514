// One map per particle (Rao-Blackwellization): each particle carries the online sparse Gaussian
// processes of its own past path, so that evidence weighs paths, not only places. Copies that
// resampling makes share their maps until one of them is written to.
#pragma once

#include <vector>

#include "gp_localize/map_model.hpp"
#include "gp_localize/online_sparse_gp.hpp"

namespace gp_localize {

/// A step costs O(P F m^2), for P particles and F fields.
class ParticleMap : public MapModel {
 public:
  ParticleMap(const GpLocalizeParams& params, const std::vector<FieldModel>& fields);

  void restart(const field_core::SE2& pose, const Eigen::Matrix3d& covariance,
               const MotionModel& model, field_core::Random& random) override;
  void relocate(const ParticleSet& particles, field_core::Random& random) override;
  void move(const field_core::OdometryMotion&, const MotionModel&, field_core::Random&) override {}
  void weigh(const ParticleSet& particles, const field_core::SE2& sensor_in_base,
             const std::vector<Observation>& observations, std::vector<double>& log_likelihood,
             Innovation& innovation) override;
  void learn(const ParticleSet& particles, const field_core::SE2& sensor_in_base,
             const std::vector<Observation>& observations, field_core::Random& random) override;
  void resampled(const std::vector<int>& ancestors) override;
  void predict(int field, const Eigen::Matrix2Xd& points, const ParticleSet& particles,
               Eigen::VectorXd& mean, Eigen::VectorXd& variance) const override;
  void save(field_core::State& state) const override;
  void restore(const field_core::State& state) override;

  int distinct_maps() const { return static_cast<int>(pool_.size() - free_.size()); }

 private:
  using Maps = std::vector<OnlineSparseGp>;  // one per field
  void share_among_all(int particles);
  Maps& own_maps(std::size_t particle);  // copies them if they are shared
  void end_slice();

  std::vector<FieldModel> fields_;
  int slice_size_;
  Recent recent_;
  int steps_in_slice_ = 0;
  // As many maps as particles; owner_[p] is particle p's, users_[i] how many particles map i has.
  std::vector<Maps> pool_;
  std::vector<int> users_, free_, owner_;
  // Kept between steps; weigh() leaves in evaluations_ what learn() goes on with.
  std::vector<OnlineSparseGp::Evaluation> evaluations_;  // [observation * P + particle]
  std::vector<Features> features_;                       // [observation]
  Eigen::Matrix2Xd points_;
  std::vector<int> new_owner_;
};

}  // namespace gp_localize
