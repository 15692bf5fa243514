#include "gp_localize/health_monitor.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <numeric>

namespace gp_localize {

HealthMonitor::HealthMonitor(const HealthParams& params)
    : params_(params), nis_(params.window, 0.0), dof_(params.window, 0.0) {}

void HealthMonitor::add(const field_core::UpdateResult& result, const Eigen::Matrix3d& covariance) {
  const auto eigen = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(
      covariance.topLeftCorner<2, 2>(), Eigen::EigenvaluesOnly);
  spread_ = eigen.eigenvalues()[1] > params_.stddev * params_.stddev;
  if (!result.applied || result.nis_dof == 0) return;
  nis_[count_ % params_.window] = result.nis;
  dof_[count_ % params_.window] = result.nis_dof;
  ++count_;
  if (2 * count_ < params_.window) return;
  // Summed anew: a running sum would keep the rounding of an old outlier for ever.
  const double ratio = std::accumulate(nis_.begin(), nis_.end(), 0.0) /
                       std::accumulate(dof_.begin(), dof_.end(), 0.0);
  if (ratio > params_.nis) contradicted_ = true;
  if (ratio < 0.5 * params_.nis) contradicted_ = false;
}

void HealthMonitor::restart() {
  std::fill(nis_.begin(), nis_.end(), 0.0);
  std::fill(dof_.begin(), dof_.end(), 0.0);
  count_ = 0;
  contradicted_ = spread_ = false;
}

field_core::Health HealthMonitor::health() const {
  if (contradicted_) return {true, "the measurements contradict the map at this pose"};
  if (spread_) return {true, "the pose is too uncertain"};
  return {};
}

Eigen::MatrixXd HealthMonitor::numbers() const {
  Eigen::VectorXd all(number_count());
  all << Eigen::Map<const Eigen::VectorXd>(nis_.data(), params_.window),
      Eigen::Map<const Eigen::VectorXd>(dof_.data(), params_.window), count_,
      contradicted_ ? 1.0 : 0.0, spread_ ? 1.0 : 0.0;
  return all;
}

void HealthMonitor::restore(const Eigen::MatrixXd& numbers) {
  const int w = params_.window;
  std::copy(numbers.data(), numbers.data() + w, nis_.begin());
  std::copy(numbers.data() + w, numbers.data() + 2 * w, dof_.begin());
  count_ = static_cast<int>(numbers(2 * w));
  contradicted_ = numbers(2 * w + 1) != 0.0;
  spread_ = numbers(2 * w + 2) != 0.0;
}

}  // namespace gp_localize
