// The whole run as one least-squares problem: all poses, the sensor's offset and all nodes at once
// (paper section II: what GraphSLAM does with the same model).
//
// The cost is 1/2 the sum of squared whitened residuals of
//   the start        (x_0, c) ~ N(start, P_0)                                       eq. (12)-(13)
//   odometry         x_a^-1 x_b = d + e, in the frame of x_a, e ~ N(0, R)            eq. (8), (49)
//   measurements     z = h(x, c, m of one cell) + e, e ~ N(0, Q)                     eq. (7), (47)
//   new nodes        m ~ N(prior), or m = A1 m_far + A2 m_near + e, e ~ N(0, S)      eq. (14)
// so its minimum is what the EKF would estimate if the model were linear. One deviation from the
// filters: c is one constant of the run, without process noise.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "vector_field_slam/node_table.hpp"
#include "vector_field_slam/solver.hpp"

namespace vector_field_slam {

/// What ties a pose to the one before it, or to the map.
struct PoseLink {
  bool absolute = false;  ///< value is the pose itself (/initialpose), not a motion
  field_core::SE2 value;  ///< motion from the pose before, in its frame
  /// W with W^T W = covariance^-1 of (x, y, yaw)
  Eigen::Matrix3d square_root = Eigen::Matrix3d::Identity();
};

/// W with W^T W = covariance^-1. Variances below kSmallestVariance (1e-4 m or rad, squared) are
/// raised by it: odometry may be exact in one direction, least squares weights may not be infinite.
/// @throws field_core::NumericalError if the covariance is not positive semi-definite
Eigen::Matrix3d square_root_information(const Eigen::Matrix3d& covariance);
constexpr double kSmallestVariance = 1e-8;

template <int M>
struct BatchProblem {
  using Values = Eigen::Matrix<double, M, 1>;

  /// One sample at a pose: readings [first, first + count) of `readings`.
  struct Measurement {
    int pose;
    Mounting<double> mounting;
    int first, count;
    GridIndex cell;  ///< last known; another one if the sensor is there and its nodes exist
  };
  struct NodePrior {
    int node;
    Values mean, variance;
  };
  struct NodeLink {
    int node, near, far;
  };

  // Variables, as far as they are known.
  std::vector<Eigen::Vector3d> poses;
  Eigen::Vector2d offset = Eigen::Vector2d::Zero();
  std::vector<Values> nodes;
  NodeTable table;  ///< numbers the nodes

  // Factors. links[t] belongs to poses[t], t > 0.
  RobotVector start_mean = RobotVector::Zero();
  RobotMatrix start_information = RobotMatrix::Identity();
  std::vector<PoseLink> links;
  std::vector<Measurement> measurements;
  std::vector<Observation<double>> readings;
  std::vector<NodePrior> priors;
  std::vector<NodeLink> node_links;

  int variables() const {
    return 3 * static_cast<int>(poses.size()) + M * static_cast<int>(nodes.size()) + 2;
  }
};

}  // namespace vector_field_slam
