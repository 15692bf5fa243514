#include "field_ros/convert.hpp"

#include <cmath>
#include <set>

#include "field_core/errors.hpp"

namespace field_ros {
namespace {

// Places of x, y, yaw among (x, y, z, roll, pitch, yaw).
constexpr int kPlanar[3] = {0, 1, 5};

template <class Quaternion>
double yaw_of(const Quaternion& q) {
  return std::atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z));
}

}  // namespace

using field_core::SE2;
using field_core::Stamp;

ros::Time to_ros(Stamp stamp) {
  ros::Time time;
  if (stamp.count() > 0) time.fromNSec(static_cast<std::uint64_t>(stamp.count()));
  return time;
}

Stamp from_ros(const ros::Time& time) { return Stamp(static_cast<std::int64_t>(time.toNSec())); }

geometry_msgs::Pose to_pose(const SE2& pose) {
  geometry_msgs::Pose out;
  out.position.x = pose.x();
  out.position.y = pose.y();
  out.orientation.z = std::sin(0.5 * pose.yaw());
  out.orientation.w = std::cos(0.5 * pose.yaw());
  return out;
}

geometry_msgs::Transform to_transform(const SE2& pose) {
  const geometry_msgs::Pose p = to_pose(pose);
  geometry_msgs::Transform out;
  out.translation.x = p.position.x;
  out.translation.y = p.position.y;
  out.rotation = p.orientation;
  return out;
}

SE2 from_pose(const geometry_msgs::Pose& pose) {
  return SE2(pose.position.x, pose.position.y, yaw_of(pose.orientation));
}

SE2 from_transform(const geometry_msgs::Transform& t) {
  return SE2(t.translation.x, t.translation.y, yaw_of(t.rotation));
}

void set_covariance(const Eigen::Matrix3d& covariance,
                    geometry_msgs::PoseWithCovariance::_covariance_type& ros) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) ros[6 * kPlanar[i] + kPlanar[j]] = covariance(i, j);
  }
}

Eigen::Matrix3d get_covariance(const geometry_msgs::PoseWithCovariance::_covariance_type& ros) {
  Eigen::Matrix3d covariance;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) covariance(i, j) = ros[6 * kPlanar[i] + kPlanar[j]];
  }
  return covariance;
}

geometry_msgs::PoseWithCovarianceStamped to_pose_message(const field_core::Belief& belief,
                                                         const std::string& frame) {
  geometry_msgs::PoseWithCovarianceStamped out;
  out.header.stamp = to_ros(belief.stamp);
  out.header.frame_id = frame;
  out.pose.pose = to_pose(belief.mean);
  set_covariance(belief.covariance, out.pose.covariance);
  return out;
}

field_msgs::EstimatorState to_message(const field_core::State& state) {
  field_msgs::EstimatorState out;
  out.estimator = state.estimator();
  out.version = state.version();
  for (const auto& [name, matrix] : state.numbers()) {
    field_msgs::NamedArray block;
    block.name = name;
    block.shape = {static_cast<std::uint32_t>(matrix.rows()),
                   static_cast<std::uint32_t>(matrix.cols())};
    block.data.assign(matrix.data(), matrix.data() + matrix.size());
    out.blocks.push_back(std::move(block));
  }
  for (const auto& [name, text] : state.texts()) {
    field_msgs::NamedArray block;
    block.name = name;
    block.text = text;
    out.blocks.push_back(std::move(block));
  }
  return out;
}

field_core::State from_message(const field_msgs::EstimatorState& message) {
  field_core::State state(message.estimator, message.version);
  std::set<std::pair<bool, std::string>> seen;
  for (const auto& block : message.blocks) {
    const bool numeric = !block.shape.empty();
    const auto fail = [&block](const std::string& problem) {
      return field_core::DataError("the state's block '" + block.name + "' " + problem +
                                   "; the file is damaged, use another");
    };
    if (!seen.emplace(numeric, block.name).second) throw fail("comes twice");
    if (!numeric) {
      if (!block.data.empty()) throw fail("has numbers but no shape");
      state.set_text(block.name, block.text);
      continue;
    }
    if (block.shape.size() != 2 ||
        std::uint64_t{block.shape[0]} * block.shape[1] != block.data.size()) {
      throw fail("has another size than its shape says");
    }
    state.set(block.name,
              Eigen::Map<const Eigen::MatrixXd>(block.data.data(), block.shape[0], block.shape[1]));
  }
  return state;
}

}  // namespace field_ros
