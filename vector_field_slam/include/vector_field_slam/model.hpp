// The model as the host's solvers share it: what Params say, in the terms of the model headers.
//
// How a solver uses the model, for one sample at `robot` = (x, y, yaw, c_x, c_y):
//   SensorPose<double> sensor(robot, mounting);
//   GridIndex cell;  model.grid.cell_of(sensor.x, sensor.y, cell);
//   Interpolation<double> at(model.grid, cell, sensor.x, sensor.y);
//   for each reading:  p = model.sensor.predict(channel, sensor, robot + kPose, at, node_values);
//                      local_row<M>(p, at, channel, row);     // row of H over robot and four nodes
// and a new node takes its mean from `extrapolation`, its spread from `extrapolation_variance`.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "field_core/estimator.hpp"
#include "vector_field_slam/linear_start.hpp"
#include "vector_field_slam/node_extrapolation.hpp"
#include "vector_field_slam/odometry_step.hpp"
#include "vector_field_slam/params.hpp"
#include "vector_field_slam/sensor_model.hpp"

namespace vector_field_slam {

constexpr int kMostChannels = 8;

/// Variances and roles of the channels that do not depend on their number.
struct ChannelModel {
  Channel role;
  double noise_variance = 0.0;          ///< of the sensor, channel unit squared
  double interpolation_variance = 0.0;  ///< of the field between nodes; Q is the sum of both
  double prior_variance = 0.0;          ///< eq. (13), node unit squared
  double extrapolation_variance = 0.0;  ///< S of eq. (14), node unit squared
};

/// Channels in the order of their names, as Sample::readings index them.
/// @throws field_core::ParameterError for a planar channel without its partner
std::vector<ChannelModel> make_channels(const VectorFieldSlamParams& params);
std::vector<field_core::FieldInfo> field_infos(const VectorFieldSlamParams& params);

/// The same for M channels.
template <int M>
struct Model {
  GridGeometry<double> grid;
  SensorModel<double, M> sensor;
  ExtrapolationFactors<double, M> extrapolation;
  double prior_variance[M], extrapolation_variance[M];

  Model(const VectorFieldSlamParams& params, const std::vector<ChannelModel>& channels)
      : grid(GridGeometry<double>::around(params.initial_pose_x, params.initial_pose_y,
                                          params.cell_size)),
        sensor(make_sensor(channels)),
        extrapolation(sensor.channels, params.sensor_model == SensorModelType::beacon_pairs
                                           ? Extrapolation::common
                                           : Extrapolation::linear) {
    for (int i = 0; i < M; ++i) {
      prior_variance[i] = channels[i].prior_variance;
      extrapolation_variance[i] = channels[i].extrapolation_variance;
    }
  }

 private:
  static SensorModel<double, M> make_sensor(const std::vector<ChannelModel>& channels) {
    SensorModel<double, M> sensor;
    for (int i = 0; i < M; ++i) sensor.channels[i] = channels[i].role;
    return sensor;
  }
};

/// A motion that odometry reports, at a pose (x, y, yaw), with its noise: Probabilistic Robotics,
/// table 5.6, in the coordinates of eq. (49).
OdometryStep<double> odometry_step(const field_core::OdometryMotionModel& model,
                                   const field_core::SE2& pose, const field_core::SE2& delta);

}  // namespace vector_field_slam
