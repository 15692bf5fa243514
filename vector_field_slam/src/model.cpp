#include "vector_field_slam/model.hpp"

#include <Eigen/Core>

#include "field_core/errors.hpp"

namespace vector_field_slam {
namespace {

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() > end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

bool turns_with_robot(SensorModelType type, const std::string& name) {
  const bool vector = type == SensorModelType::beacon_pairs || type == SensorModelType::magnetic;
  return vector && (ends_with(name, "_x") || ends_with(name, "_y"));
}

/// Index of the other axis of a vector's channel.
int partner_of(const VectorFieldSlamParams& params, const std::string& name) {
  std::string other = name;
  other.back() = name.back() == 'x' ? 'y' : 'x';
  const auto found = params.channels.find(other);
  if (found == params.channels.end()) {
    throw field_core::ParameterError(
        "channels/" + name,
        "turns with the robot and needs its other axis, channel '" + other + "'");
  }
  return static_cast<int>(std::distance(params.channels.begin(), found));
}

double square(double x) { return x * x; }

}  // namespace

std::vector<ChannelModel> make_channels(const VectorFieldSlamParams& params) {
  std::vector<ChannelModel> channels;
  for (const auto& [name, p] : params.channels) {
    ChannelModel c;
    if (turns_with_robot(params.sensor_model, name)) {
      c.role.kind = name.back() == 'x' ? ChannelKind::planar_x : ChannelKind::planar_y;
      c.role.partner = static_cast<std::int8_t>(partner_of(params, name));
    } else if (params.sensor_model == SensorModelType::range) {
      c.role.kind = ChannelKind::range;
    }
    c.noise_variance = square(p.noise_stddev);
    c.interpolation_variance = square(p.interpolation_stddev);
    const double prior = p.prior_stddev > 0.0 ? p.prior_stddev : 10.0 * p.noise_stddev;
    c.prior_variance = square(prior);
    c.extrapolation_variance =
        square(p.extrapolation_stddev > 0.0 ? p.extrapolation_stddev : 0.5 * prior);
    channels.push_back(c);
  }
  return channels;
}

std::vector<field_core::FieldInfo> field_infos(const VectorFieldSlamParams& params) {
  std::vector<field_core::FieldInfo> infos;
  for (const auto& [name, p] : params.channels) infos.push_back({name, p.unit});
  return infos;
}

OdometryStep<double> odometry_step(const field_core::OdometryMotionModel& model,
                                   const field_core::SE2& pose, const field_core::SE2& delta) {
  const auto prediction = model.predict(pose, field_core::OdometryMotion::from(delta));
  const Eigen::Matrix3d noise =
      prediction.motion_jacobian * prediction.motion_noise * prediction.motion_jacobian.transpose();
  OdometryStep<double> step{
      prediction.mean.x() - pose.x(), prediction.mean.y() - pose.y(), delta.yaw(), {}};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) step.noise[i][j] = noise(i, j);
  }
  return step;
}

}  // namespace vector_field_slam
