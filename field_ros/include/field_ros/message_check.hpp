// Checks that turn a message into a value, or into the reason why it is dropped. Nothing here
// throws.
#pragma once

#include <field_msgs/FieldMeasurement.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <nav_msgs/Odometry.h>

#include <string>
#include <unordered_map>
#include <vector>

#include "field_core/estimator.hpp"
#include "field_ros/drop_reason.hpp"

namespace field_ros {

struct OdometrySample {
  field_core::Stamp stamp{0};
  field_core::SE2 pose;  ///< accumulated, in the odometry frame
};

struct FieldSample {
  field_core::Stamp stamp{0};
  std::string frame;  ///< of the sensor; empty: the base
  std::vector<field_core::Reading> readings;
  int unknown_fields = 0;  ///< names in the message that are not configured; the others are used
};

struct PoseGuess {
  field_core::Stamp stamp{0};  ///< 0: now
  field_core::SE2 pose;
  Eigen::Matrix3d covariance;
};

struct PositionSample {
  field_core::Stamp stamp{0};
  field_core::PositionObservation observation;
};

/// Names of the configured fields to their indices in E::fields().
using FieldIndex = std::unordered_map<std::string, int>;
FieldIndex index_fields(const std::vector<field_core::FieldInfo>& fields);

/// A frame without the leading slash that tf (not tf2) allowed.
std::string tf2_frame(const std::string& frame);

/// Finite coordinates, a quaternion of length 1. none: it can be used.
DropReason check_pose(const geometry_msgs::Pose& pose);

/// Frames of the message may be left empty; otherwise they must be the given ones. The pose's
/// covariance is not used, but one that cannot be is taken as a sign of a broken source.
Checked<OdometrySample> check_odometry(const nav_msgs::Odometry& message,
                                       const std::string& odom_frame,
                                       const std::string& base_frame);

/// O(number of names), refused before anything else if there are more than `max_fields`.
Checked<FieldSample> check_field(const field_msgs::FieldMeasurement& message,
                                 const FieldIndex& fields, std::size_t max_fields);

/// The covariance gets kMinimumPoseVariance on its diagonal: "exactly here" is a legal guess.
Checked<PoseGuess> check_initialpose(const geometry_msgs::PoseWithCovarianceStamped& message,
                                     const std::string& global_frame);

/// The position alone is looked at: its orientation may be anything. A covariance of 0 stays 0 (the
/// configured noise); any other must be positive definite.
Checked<PositionSample> check_position(const geometry_msgs::PoseWithCovarianceStamped& message,
                                       const std::string& global_frame);

}  // namespace field_ros
