// The paper's baselines along every sample path: full GP, subsets of data, and PITC computed anew
// from all measurements at every step. For comparison: memory grows with the run, and but for the
// subsets so does the time of a step.
#pragma once

#include <vector>

#include "gp_localize/dense_gp.hpp"
#include "gp_localize/online_sparse_gp.hpp"
#include "interpolation_box.hpp"
#include "path_bank.hpp"

namespace gp_localize {

class DensePathBank final : public PathBank {
 public:
  DensePathBank(const FieldModel& field, const GpLocalizeParams& params);

  void restart() override;
  void begin(int particles) override;
  void add(const Places& places, double value, double noise_variance, PathBank& total,
           Eigen::Matrix2Xd& moments) override;
  void log_mean(std::vector<double>& log_likelihood) const override;
  void learn(const Places& places, double value, double noise_variance) override;
  void close_slice() override {}
  void predict(const Places& points, Eigen::Matrix2Xd& moments) const override;
  void save(field_core::State& state) const override;
  void check(const field_core::State& state) const override;
  void restore(const field_core::State& state) override;

 private:
  /// Lays the box of nodes around particles that stand close together, where it pays.
  bool fit_box(const Places& places, double noise_variance);
  /// Moments under one path, 2 x places.
  void predict_path(std::size_t path, const Places& places, Eigen::Matrix2Xd& moments) const;
  void offline_pitc(const DenseGp& path, const Places& places, Eigen::Matrix2Xd& moments) const;

  const FieldModel& field_;
  ObservationModelType model_;
  int subset_size_, slice_size_;
  double tolerance_;  // of interpolation
  InterpolationBox box_;
  std::vector<DenseGp> paths_;
  Eigen::MatrixXd log_densities_;  // particles x paths
};

}  // namespace gp_localize
