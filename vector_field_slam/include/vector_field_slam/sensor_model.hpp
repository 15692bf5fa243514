// What a sensor reads at a pose, given the node values: eq. (7) with all its derivatives.
//
// All sensors share one form. The field h0(p) is interpolated from the nodes (eq. 2); a channel i
// then reads, with phi the sensor's yaw and p its place,
//   scalar     z_i = h0_i                                        WiFi, light, temperature
//   planar_x   z_i =  cos(phi) h0_i + sin(phi) h0_k + c_x        eq. (47); k is the partner channel
//   planar_y   z_i = -sin(phi) h0_k + cos(phi) h0_i + c_y
//   range      z_i = |p|^2 + h0_i                                radio beacons; z_i = r^2
// Optical beacon pairs are planar_x, planar_y for each spot; a magnetometer is one such pair and a
// scalar for the vertical axis (whose offset cannot be told from the field). The offset c is shared
// by all planar channels. A range channel is observed by its square, see as_observation(): of a
// beacon at b, r^2 - |p|^2 = |b|^2 - 2 b.p is linear in p, which bilinear interpolation represents
// exactly wherever the beacon is (a map of r has a cusp at the beacon), and r^2 is linear in the
// nodes (r is not: with nodes that are hardly known, its derivative is wrong by any factor, and the
// filter learns what is not so). p is relative to node (0, 0).
#pragma once

#include "vector_field_slam/bilinear.hpp"

namespace vector_field_slam {

enum class ChannelKind : std::uint8_t { scalar, planar_x, planar_y, range };

struct Channel {
  ChannelKind kind = ChannelKind::scalar;
  std::int8_t partner = -1;  ///< of planar channels: the other axis of the same vector
};

/// Variables of the robot that every solver keeps first: x, y [m], yaw [rad], c_x, c_y [of planar
/// channels].
constexpr int kPose = 3;
constexpr int kRobot = 5;

/// One reading that a solver is to use; of a range its square.
template <class S>
struct Observation {
  int channel;
  S value;
  S variance;  ///< Q, > 0
};

/// A reading of a channel as the solvers use it. A range r with noise variance q becomes r^2 - q,
/// for the true square is on average by q smaller, with variance 4 r^2 q + 2 q^2.
template <class S>
Observation<S> as_observation(int channel, ChannelKind kind, S reading, S variance) {
  if (kind != ChannelKind::range) return {channel, reading, variance};
  const S square = reading * reading;
  return {channel, square - variance, S(4) * square * variance + S(2) * variance * variance};
}

/// Where the sensor sits on the robot.
template <class S>
struct Mounting {
  S x = S(0), y = S(0), yaw = S(0);
};

/// Pose of the sensor in the map frame, with its derivatives by the robot's yaw.
template <class S>
struct SensorPose {
  S x, y, cos_yaw, sin_yaw;
  S x_yaw, y_yaw;  ///< d x / d yaw, d y / d yaw [m/rad]

  SensorPose(const S* robot, const Mounting<S>& m) {
    const S c = std::cos(robot[2]), s = std::sin(robot[2]);
    x_yaw = -s * m.x - c * m.y;
    y_yaw = c * m.x - s * m.y;
    x = robot[0] + y_yaw;
    y = robot[1] - x_yaw;
    if (m.yaw == S(0)) {
      cos_yaw = c;
      sin_yaw = s;
    } else {
      cos_yaw = std::cos(robot[2] + m.yaw);
      sin_yaw = std::sin(robot[2] + m.yaw);
    }
  }
};

/// One row of the linearized sensor model: what is read, and the derivatives by what it depends on.
template <class S>
struct ChannelPrediction {
  S value;
  S robot[kRobot];  ///< d z / d (x, y, yaw, c_x, c_y)
  S own, other;     ///< d z / d h0 of the channel itself and of its partner
  int partner;      ///< -1: none, and `other` is 0
};

/// Sensor model of M channels. Stateless but for the roles of the channels; all functions O(1).
template <class S, int M>
struct SensorModel {
  Channel channels[M];

  /// Interpolated value of a channel and its derivatives by the place. `nodes[j]` points to the M
  /// values of node j of the cell.
  static void interpolate(const Interpolation<S>& at, const S* const* nodes, int channel, S& value,
                          S& by_x, S& by_y) {
    value = by_x = by_y = S(0);
    for (int j = 0; j < 4; ++j) {
      const S m = nodes[j][channel];
      value += at.w[j] * m;
      by_x += at.w_x[j] * m;
      by_y += at.w_y[j] * m;
    }
  }

  /// Eq. (7) for one channel. @param offset c_x, c_y
  ChannelPrediction<S> predict(int channel, const SensorPose<S>& sensor, const S* offset,
                               const Interpolation<S>& at, const S* const* nodes) const {
    const Channel role = channels[channel];
    S h, h_x, h_y;
    interpolate(at, nodes, channel, h, h_x, h_y);
    ChannelPrediction<S> p{h, {h_x, h_y, S(0), S(0), S(0)}, S(1), S(0), -1};
    if (role.kind == ChannelKind::range) {
      p.value = at.x * at.x + at.y * at.y + h;
      p.robot[0] += S(2) * at.x;
      p.robot[1] += S(2) * at.y;
    } else if (role.kind != ChannelKind::scalar) {
      S g, g_x, g_y;
      interpolate(at, nodes, role.partner, g, g_x, g_y);
      const bool is_x = role.kind == ChannelKind::planar_x;
      const S c = sensor.cos_yaw, s = is_x ? sensor.sin_yaw : -sensor.sin_yaw;
      p.value = c * h + s * g + offset[is_x ? 0 : 1];
      p.robot[0] = c * h_x + s * g_x;
      p.robot[1] = c * h_y + s * g_y;
      p.robot[2] = -sensor.sin_yaw * h + (is_x ? c : -c) * g;
      p.robot[is_x ? 3 : 4] = S(1);
      p.own = c;
      p.other = s;
      p.partner = role.partner;
    }
    p.robot[2] += p.robot[0] * sensor.x_yaw + p.robot[1] * sensor.y_yaw;
    return p;
  }

  /// The field value h0 that explains a reading at a place: inverse of predict(). Planar channels
  /// need the reading of their partner too.
  S field_value(int channel, const SensorPose<S>& sensor, const S* offset, S grid_x, S grid_y,
                S reading, S partner_reading) const {
    const Channel role = channels[channel];
    switch (role.kind) {
      case ChannelKind::range:
        return reading - grid_x * grid_x - grid_y * grid_y;
      case ChannelKind::planar_x:
        return sensor.cos_yaw * (reading - offset[0]) -
               sensor.sin_yaw * (partner_reading - offset[1]);
      case ChannelKind::planar_y:
        return sensor.cos_yaw * (reading - offset[1]) +
               sensor.sin_yaw * (partner_reading - offset[0]);
      default:
        return reading;
    }
  }
};

/// d z / d (values of the cell's nodes): M values for each of the four nodes in cell_node order.
/// @param row 4 M numbers, all set
template <class S, int M>
void node_row(const ChannelPrediction<S>& p, const Interpolation<S>& at, int channel, S* row) {
  for (int i = 0; i < 4 * M; ++i) row[i] = S(0);
  for (int j = 0; j < 4; ++j) {
    row[j * M + channel] = at.w[j] * p.own;
    if (p.partner >= 0) row[j * M + p.partner] = at.w[j] * p.other;
  }
}

/// The row of H (eq. 18) of a reading over x, y, yaw, c_x, c_y and the values of the cell's nodes.
/// @param row kRobot + 4 M numbers, all set
template <class S, int M>
void local_row(const ChannelPrediction<S>& p, const Interpolation<S>& at, int channel, S* row) {
  for (int i = 0; i < kRobot; ++i) row[i] = p.robot[i];
  node_row<S, M>(p, at, channel, row + kRobot);
}

}  // namespace vector_field_slam
