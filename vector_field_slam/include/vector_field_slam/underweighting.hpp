// Underweighting: what the linearization of a reading leaves out, as additional noise.
//
// A reading is a product of what is estimated: slopes of the map times places, values times turns.
// With W the second derivatives of h, 1/2 d^T W d is left out by eq. (18), and for d ~ N(0, P) its
// variance is
//   1/2 tr(W P W P)                                    Jazwinski 1970; the Gaussian second-order
//   filter.
// A filter that adds none of it takes the slope of a map that is hardly known for the true one,
// another one after each update, and counts the differences as knowledge of the place. As the
// slopes err alike in all readings of a visit, this variance does not average out as noise would:
// it is multiplied by a factor (Zanetti, DeMars, Bishop, "Underweighting Nonlinear Measurements",
// JGCD 33(5), 2010, after Lear). Only pose x anything is curved, so W = sum_i (e_i a_i^T + a_i
// e_i^T) over i = x, y, yaw, and
//   1/2 tr(W P W P) = sum_ij (e_i P e_j)(a_i P a_j) + (e_i P a_j)(e_j P a_i).
#pragma once

#include "vector_field_slam/sensor_model.hpp"

namespace vector_field_slam {

/// The a_i of one reading: over pose and offset, and over the values of the cell's nodes.
template <class S, int M>
struct Curvature {
  S robot[kPose][kRobot] = {};
  S nodes[kPose][4 * M] = {};

  /// @param values as for SensorModel::predict()
  Curvature(const SensorModel<S, M>& model, int channel, const SensorPose<S>& sensor,
            const Interpolation<S>& at, const S* const* values) {
    const Channel role = model.channels[channel];
    const bool turns = role.partner >= 0;
    const S sign = role.kind == ChannelKind::planar_x ? S(1) : S(-1);
    const S own = turns ? sensor.cos_yaw : S(1), own_yaw = turns ? -sensor.sin_yaw : S(0);
    Place p;
    add(p, at, values, channel, own, own_yaw);
    over_nodes(at, sensor, channel, own, own_yaw);
    if (turns) {
      const S other = sign * sensor.sin_yaw, other_yaw = sign * sensor.cos_yaw;
      add(p, at, values, role.partner, other, other_yaw);
      over_nodes(at, sensor, role.partner, other, other_yaw);
    }
    if (role.kind == ChannelKind::range) {
      p.xx = p.yy = S(2);
      p.x += S(2) * at.x;
      p.y += S(2) * at.y;
    }
    over_pose(p, sensor, turns);
  }

  /// 1/2 tr(W P W P) [reading's unit squared] from (e_i P e_j), (e_i P a_j) and (a_i P a_j).
  static S variance(const S (*ee)[kPose], const S (*ea)[kPose], const S (*aa)[kPose]) {
    S sum = S(0);
    for (int i = 0; i < kPose; ++i) {
      for (int j = 0; j < kPose; ++j) sum += ee[i][j] * aa[i][j] + ea[i][j] * ea[j][i];
    }
    return sum;
  }

 private:
  /// Derivatives of the reading by the sensor's place, at a fixed and at a turning yaw.
  struct Place {
    S value = S(0), x = S(0), y = S(0), xx = S(0), xy = S(0), yy = S(0);
    S x_turn = S(0), y_turn = S(0);  ///< d^2 z / d place d yaw of the sensor's axes alone
  };

  static void add(Place& p, const Interpolation<S>& at, const S* const* values, int channel,
                  S weight, S weight_yaw) {
    S h, h_x, h_y;
    SensorModel<S, M>::interpolate(at, values, channel, h, h_x, h_y);
    const S scale = at.w_x[1] + at.w_x[3];  // 1 / cell_size
    const S h_xy =
        scale * scale *
        (values[0][channel] - values[1][channel] - values[2][channel] + values[3][channel]);
    p.value += weight * h;
    p.x += weight * h_x;
    p.y += weight * h_y;
    p.xy += weight * h_xy;
    p.x_turn += weight_yaw * h_x;
    p.y_turn += weight_yaw * h_y;
  }

  void over_nodes(const Interpolation<S>& at, const SensorPose<S>& sensor, int channel, S weight,
                  S weight_yaw) {
    for (int j = 0; j < 4; ++j) {
      nodes[0][j * M + channel] = weight * at.w_x[j];
      nodes[1][j * M + channel] = weight * at.w_y[j];
      nodes[2][j * M + channel] =
          weight_yaw * at.w[j] + weight * (at.w_x[j] * sensor.x_yaw + at.w_y[j] * sensor.y_yaw);
    }
  }

  /// W over the pose: halves on both sides. The place's own second derivatives by the yaw are
  /// (-y_yaw, x_yaw).
  void over_pose(const Place& p, const SensorPose<S>& sensor, bool turns) {
    const S u = sensor.x_yaw, v = sensor.y_yaw;
    const S x_yaw = p.x_turn + p.xx * u + p.xy * v, y_yaw = p.y_turn + p.xy * u + p.yy * v;
    const S yaw_yaw = (turns ? -p.value : S(0)) + S(2) * (p.x_turn * u + p.y_turn * v) +
                      u * (p.xx * u + p.xy * v) + v * (p.xy * u + p.yy * v) - p.x * v + p.y * u;
    const S w[kPose][kPose] = {{p.xx, p.xy, x_yaw}, {p.xy, p.yy, y_yaw}, {x_yaw, y_yaw, yaw_yaw}};
    for (int i = 0; i < kPose; ++i) {
      for (int j = 0; j < kPose; ++j) robot[i][j] = S(0.5) * w[i][j];
    }
  }
};

}  // namespace vector_field_slam
