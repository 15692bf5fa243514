// VectorFieldSlam::predict_field: interpolation of nodes with their covariance.
#include <cmath>
#include <map>
#include <optional>

#include "vector_field_slam/vector_field_slam.hpp"

namespace vector_field_slam {
namespace {

/// The nodes of a cell with their joint covariance.
struct CellMap {
  std::vector<int> nodes;
  Eigen::MatrixXd covariance;
};

std::optional<CellMap> cell_map(const Solver& solver, GridIndex cell) {
  CellMap map;
  for (int j = 0; j < 4; ++j) {
    map.nodes.push_back(solver.find(cell_node(cell, j)));
    if (map.nodes.back() < 0) return std::nullopt;
  }
  map.covariance = solver.node_covariance(map.nodes);
  return map;
}

Eigen::VectorXd mean_values(const Solver& solver, Eigen::Index channels) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(channels);
  for (int i = 0; i < solver.node_count(); ++i) {
    sum += Eigen::Map<const Eigen::VectorXd>(solver.node_values(i), channels);
  }
  return sum / std::max(1, solver.node_count());
}

/// A node value as a reading: ranges are stored as r^2 - |p|^2.
void as_reading(const ChannelModel& channel, double square_distance, double& mean,
                double& variance) {
  if (channel.role.kind != ChannelKind::range) return;
  constexpr double kShortest = 0.1;  // [m] the root has no derivative at 0
  mean = std::sqrt(std::max(mean + square_distance, kShortest * kShortest));
  variance /= 4.0 * mean * mean;
}

}  // namespace

field_core::FieldPrediction VectorFieldSlam::predict_field(const Eigen::Matrix2Xd& points) const {
  const auto count = static_cast<Eigen::Index>(channels_.size());
  field_core::FieldPrediction p;
  p.mean.setZero(count, points.cols());
  p.variance.resize(count, points.cols());
  p.prior_variance.resize(count);
  const Eigen::VectorXd everywhere =
      started_ ? mean_values(*solver_, count) : Eigen::VectorXd::Zero(count);
  std::map<std::pair<int, int>, std::optional<CellMap>> cells;
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    GridIndex cell;
    const CellMap* known = nullptr;
    const bool valid = started_ && grid_.cell_of(points(0, k), points(1, k), cell);
    if (valid) {
      const auto [entry, is_new] = cells.try_emplace({cell.x, cell.y});
      if (is_new) entry->second = cell_map(*solver_, cell);
      if (entry->second) known = &*entry->second;
    }
    const Interpolation<double> at(grid_, cell, points(0, k), points(1, k));
    const Eigen::Map<const Eigen::Vector4d> w(at.w);
    for (Eigen::Index i = 0; i < count; ++i) {
      double mean = everywhere[i], variance = channels_[i].prior_variance;
      if (known) {
        Eigen::Vector4d values;
        Eigen::Matrix4d covariance;
        for (int a = 0; a < 4; ++a) {
          values[a] = solver_->node_values(known->nodes[a])[i];
          for (int b = 0; b < 4; ++b) {
            covariance(a, b) = known->covariance(a * count + i, b * count + i);
          }
        }
        mean = w.dot(values);
        variance = w.dot(covariance * w);
      }
      as_reading(channels_[i], at.x * at.x + at.y * at.y, mean, variance);
      p.mean(i, k) = mean;
      p.variance(i, k) =
          variance + channels_[i].noise_variance + channels_[i].interpolation_variance;
    }
  }
  for (Eigen::Index i = 0; i < count; ++i) {
    double mean = everywhere[i], variance = channels_[i].prior_variance;
    as_reading(channels_[i], 0.0, mean, variance);
    p.prior_variance[i] =
        variance + channels_[i].noise_variance + channels_[i].interpolation_variance;
  }
  return p;
}

}  // namespace vector_field_slam
