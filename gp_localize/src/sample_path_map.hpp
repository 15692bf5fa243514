// The paper's map: C sample paths drawn from the motion model, one online sparse Gaussian process
// per path and field, shared by all particles (eq. 8-9, remark 3 after theorem 1).
#pragma once

#include <memory>
#include <vector>

#include "gp_localize/map_model.hpp"
#include "path_bank.hpp"

namespace gp_localize {

class SamplePathMap : public MapModel {
 public:
  SamplePathMap(const GpLocalizeParams& params, const std::vector<FieldModel>& fields);

  void restart(const field_core::SE2& pose, const Eigen::Matrix3d& covariance,
               const MotionModel& model, field_core::Random& random) override;
  void relocate(const ParticleSet& particles, field_core::Random& random) override;
  void move(const field_core::OdometryMotion& motion, const MotionModel& model,
            field_core::Random& random) override;
  void weigh(const ParticleSet& particles, const field_core::SE2& sensor_in_base,
             const std::vector<Observation>& observations, std::vector<double>& log_likelihood,
             Innovation& innovation) override;
  void learn(const ParticleSet& particles, const field_core::SE2& sensor_in_base,
             const std::vector<Observation>& observations, field_core::Random& random) override;
  void resampled(const std::vector<int>&) override {}
  FieldVariances variances(int field, const ParticleSet&) const override {
    return {fields_[field].signal_variance(), fields_[field].noise_variance};
  }
  void predict(int field, const Eigen::Matrix2Xd& points, const ParticleSet& particles,
               Eigen::VectorXd& mean, Eigen::VectorXd& variance) const override;
  void save(field_core::State& state) const override;
  void restore(const field_core::State& state, const std::vector<int>& ancestors) override;

 private:
  /// Adds the readings of one group, which_ of the step's observations, to `total`.
  void weigh_group(const ParticleSet& particles, const std::vector<Observation>& observations,
                   PathBank& total, Innovation& innovation);
  void close_slice();
  /// Paths continue from poses drawn from the particles, by low-variance sampling.
  void redraw_paths(const ParticleSet& particles, field_core::Random& random);

  std::vector<FieldModel> fields_;
  int slice_size_;
  bool redraw_;
  std::vector<RobotState> paths_;                 // where each path stands
  std::vector<std::unique_ptr<PathBank>> banks_;  // one per group
  int steps_in_slice_ = 0;
  // Kept between steps: of the particles, and of the paths.
  Places points_, path_points_;
  Places labelled_points_, labelled_;  // the same with the number of a field
  std::vector<std::size_t> which_;     // observations of a group
  std::vector<Reading> readings_;      // the same
  std::vector<Eigen::Matrix2Xd> moments_;
  std::vector<double> weights_;
  std::vector<int> drawn_;
};

}  // namespace gp_localize
