// Online PITC (eq. 10-13) along every sample path.
#pragma once

#include <memory>
#include <vector>

#include "gp_localize/online_sparse_gp.hpp"
#include "path_bank.hpp"
#include "path_panels.hpp"

namespace gp_localize {

/// add(): O(P C m^2); learn(): O(C m^2); memory O(C m^2). Nothing grows with time.
class SparsePathBank final : public PathBank {
 public:
  SparsePathBank(const FieldModel& field, int paths, int slice_size, Recent recent,
                 Precision precision, double interpolation_tolerance);

  void restart() override;
  void begin(int particles) override { panels_->begin(particles); }
  void add(const Places& places, double value, double noise_variance, PathBank& total,
           Eigen::Matrix2Xd& moments) override;
  void add_joint(const Places& places, const std::vector<Reading>& readings, PathBank& total,
                 std::vector<Eigen::Matrix2Xd>& moments) override;
  void log_mean(std::vector<double>& out) const override { panels_->log_mean(out); }
  void learn(const Places& places, double value, double noise_variance) override;
  void close_slice() override;
  void predict(const Places& points, Eigen::Matrix2Xd& moments) const override;
  void save(field_core::State& state) const override;
  void check(const field_core::State& state) const override;
  void restore(const field_core::State& state) override;

 private:
  /// Panels from the closed summaries and the open rows of the maps.
  void fill(PathPanels& panels) const;

  int slice_capacity() const { return slice_size_ * field_.basis.fields(); }

  const FieldModel& field_;  // any of the group
  int slice_size_;           // steps
  Recent recent_;
  std::vector<OnlineSparseGp> maps_;  // one per path
  Eigen::MatrixXd closed_;            // summaries when the last slice closed
  bool learned_ = false;              // since then
  std::unique_ptr<PathPanels> panels_;
  Features path_features_;  // kept between steps
  OnlineSparseGp::Evaluation evaluation_;
};

}  // namespace gp_localize
