// Whether the filter is lost: judged from its own innovations over a window, and from its spread.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "field_core/estimator.hpp"
#include "gp_localize/params.hpp"

namespace gp_localize {

/// With a filter that is where it thinks, the normalized innovations squared of a measurement
/// average 1 per degree of freedom, or less if the configured noise is generous. They reach about
/// 2 (signal / likelihood noise)^2 where the map says something else than the field does here.
/// A new verdict needs half a window of measurements; leaving it takes half the threshold.
class HealthMonitor {
 public:
  explicit HealthMonitor(const HealthParams& params);

  /// After each update. O(1).
  void add(const field_core::UpdateResult& result, const Eigen::Matrix3d& covariance);
  /// The pose was given anew: the window starts over.
  void restart();

  field_core::Health health() const;
  bool contradicted() const { return contradicted_; }

  /// For state files: fixed size for the same parameters.
  Eigen::MatrixXd numbers() const;
  void restore(const Eigen::MatrixXd& numbers);
  Eigen::Index number_count() const { return 2 * params_.window + 3; }

 private:
  HealthParams params_;
  std::vector<double> nis_, dof_;  // ring
  int count_ = 0;                  // since the restart
  bool contradicted_ = false, spread_ = false;
};

}  // namespace gp_localize
