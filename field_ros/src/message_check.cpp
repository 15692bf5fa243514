#include "field_ros/message_check.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <unordered_set>

#include "field_ros/convert.hpp"

namespace field_ros {
namespace {

// Odometry in single precision is off by 1e-7; a hand-written "0.7071" by 2e-5.
constexpr double kQuaternionTolerance = 1e-2;
// Beyond this a coordinate in double no longer resolves a millimetre.
constexpr double kLargestCoordinate = 1e12;

bool is_coordinate(double v) { return std::abs(v) < kLargestCoordinate; }

bool frame_is(const std::string& frame, const std::string& expected) {
  return frame.empty() || tf2_frame(frame) == expected;
}

// Symmetric and positive semi-definite up to rounding.
bool is_covariance(const Eigen::Matrix3d& c) {
  if (!c.allFinite()) return false;
  const double scale = c.cwiseAbs().maxCoeff();
  if ((c - c.transpose()).cwiseAbs().maxCoeff() > 1e-6 * scale) return false;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(c, Eigen::EigenvaluesOnly);
  return solver.eigenvalues().minCoeff() >= -1e-9 * scale;
}

}  // namespace

DropReason check_pose(const geometry_msgs::Pose& pose) {
  const auto& p = pose.position;
  const auto& q = pose.orientation;
  for (const double v : {p.x, p.y, p.z, q.x, q.y, q.z, q.w}) {
    if (!is_coordinate(v)) return DropReason::non_finite_pose;
  }
  const double norm2 = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
  return std::abs(norm2 - 1.0) < kQuaternionTolerance ? DropReason::none
                                                      : DropReason::bad_quaternion;
}

FieldIndex index_fields(const std::vector<field_core::FieldInfo>& fields) {
  FieldIndex index;
  for (const auto& field : fields) index.emplace(field.name, static_cast<int>(index.size()));
  return index;
}

std::string tf2_frame(const std::string& frame) {
  return !frame.empty() && frame[0] == '/' ? frame.substr(1) : frame;
}

Checked<OdometrySample> check_odometry(const nav_msgs::Odometry& message,
                                       const std::string& odom_frame,
                                       const std::string& base_frame) {
  if (!frame_is(message.header.frame_id, odom_frame) ||
      !frame_is(message.child_frame_id, base_frame)) {
    return DropReason::unknown_frame;
  }
  const DropReason pose = check_pose(message.pose.pose);
  if (pose != DropReason::none) return pose;
  const Eigen::Matrix3d covariance = get_covariance(message.pose.covariance);
  if (!covariance.allFinite() || covariance.diagonal().minCoeff() < 0.0) {
    return DropReason::bad_covariance;
  }
  return OdometrySample{from_ros(message.header.stamp), from_pose(message.pose.pose)};
}

Checked<FieldSample> check_field(const field_msgs::FieldMeasurement& message,
                                 const FieldIndex& fields, std::size_t max_fields) {
  const std::size_t n = message.names.size();
  if (n > max_fields || message.values.size() > max_fields) return DropReason::too_many_fields;
  if (message.values.size() != n || (!message.variances.empty() && message.variances.size() != n)) {
    return DropReason::length_mismatch;
  }
  if (n == 0) return DropReason::empty_measurement;
  FieldSample sample{from_ros(message.header.stamp), tf2_frame(message.header.frame_id), {}, 0};
  sample.readings.reserve(n);
  std::unordered_set<std::string> seen;
  for (std::size_t i = 0; i < n; ++i) {
    const double value = message.values[i];
    const double variance = message.variances.empty() ? 0.0 : message.variances[i];
    if (!seen.insert(message.names[i]).second) return DropReason::duplicate_field;
    if (std::isinf(value)) return DropReason::infinite_value;
    if (!(variance >= 0.0) || std::isinf(variance)) return DropReason::negative_variance;
    const auto field = fields.find(message.names[i]);
    if (field == fields.end()) {
      ++sample.unknown_fields;
    } else if (!std::isnan(value)) {
      sample.readings.push_back({field->second, value, variance});
    }
  }
  if (sample.unknown_fields == static_cast<int>(n)) return DropReason::no_known_field;
  if (sample.readings.empty()) return DropReason::nothing_observed;
  return sample;
}

Checked<PoseGuess> check_initialpose(const geometry_msgs::PoseWithCovarianceStamped& message,
                                     const std::string& global_frame) {
  if (!frame_is(message.header.frame_id, global_frame)) return DropReason::unknown_frame;
  const DropReason pose = check_pose(message.pose.pose);
  if (pose != DropReason::none) return pose;
  Eigen::Matrix3d covariance = get_covariance(message.pose.covariance);
  if (!is_covariance(covariance)) return DropReason::bad_covariance;
  covariance = 0.5 * (covariance + covariance.transpose()).eval();
  covariance.diagonal().array() += field_core::kMinimumPoseVariance;
  return PoseGuess{from_ros(message.header.stamp), from_pose(message.pose.pose), covariance};
}

Checked<PositionSample> check_position(const geometry_msgs::PoseWithCovarianceStamped& message,
                                       const std::string& global_frame) {
  if (!frame_is(message.header.frame_id, global_frame)) return DropReason::unknown_frame;
  const auto& p = message.pose.pose.position;
  if (!is_coordinate(p.x) || !is_coordinate(p.y)) return DropReason::non_finite_pose;
  const Eigen::Matrix2d c = get_covariance(message.pose.covariance).topLeftCorner<2, 2>();
  const bool configured = c.isZero(0.0);
  // Positive definite, and not so thin that its inverse means nothing.
  const double least = 1e-12 * c.trace() * c.trace();
  const bool symmetric = std::abs(c(0, 1) - c(1, 0)) <= 1e-6 * std::abs(c.trace());
  if (!c.allFinite() || (!configured && !(symmetric && c(0, 0) > 0.0 && c.determinant() > least))) {
    return DropReason::bad_covariance;
  }
  return PositionSample{from_ros(message.header.stamp),
                        {Eigen::Vector2d(p.x, p.y), 0.5 * (c + c.transpose())}};
}

}  // namespace field_ros
