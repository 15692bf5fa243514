// The filter as a microcontroller would run it: the same code on the host and on the target.
#pragma once

#include "vector_field_slam/eseif.hpp"

namespace embedded {

using namespace vector_field_slam;

/// The paper's: 42 nodes of a 7 x 6 block, 4 channels.
constexpr int M = 4;
using Map = FixedMap<float, M, 42, 131>;
using Filter = Eseif<float, M, Map, 1>;
static_assert(sizeof(Filter::State) <= 12 * 1024, "the paper's 12 kByte");

/// What wheels and sensor report in one period.
struct Record {
  float forward, turn;                    ///< [m], [rad]
  float forward_variance, turn_variance;  ///< [m^2], [rad^2]
  float z[M];
};

inline EseifConfig<float, M> configuration() {
  constexpr Channel kChannels[M] = {{ChannelKind::planar_x, 1},
                                    {ChannelKind::planar_y, 0},
                                    {ChannelKind::planar_x, 3},
                                    {ChannelKind::planar_y, 2}};
  EseifConfig<float, M> c{GridGeometry<float>::around(0.0f, 0.0f, 1.0f),
                          {},
                          ExtrapolationFactors<float, M>(kChannels, Extrapolation::common),
                          {},
                          {}};
  for (int i = 0; i < M; ++i) {
    c.sensor.channels[i] = kChannels[i];
    c.prior_variance[i] = 0.16f;
    c.extrapolation_variance[i] = 0.04f;
  }
  c.gate = 15.0f;
  c.underweighting = 4.0f;
  return c;
}

/// Around the first reading, at the origin.
inline bool start(Filter& filter, const Record& first) {
  const float robot[kRobot] = {};
  float covariance[kRobot * kRobot] = {};
  for (int i = 0; i < kRobot; ++i) covariance[i * kRobot + i] = i < kPose ? 1e-4f : 2.5e-3f;
  float values[4][M];
  for (auto& node : values) {
    for (int i = 0; i < M; ++i) node[i] = first.z[i];
  }
  return filter.start(robot, covariance, {0, 0}, values);
}

inline bool step(Filter& filter, const Record& r) {
  const float yaw = filter.state().robot[2];
  const float c = std::cos(yaw), s = std::sin(yaw);
  const float v = r.forward_variance;
  const OdometryStep<float> step{
      c * r.forward,
      s * r.forward,
      r.turn,
      {{v * c * c, v * c * s, 0.0f}, {v * c * s, v * s * s, 0.0f}, {0.0f, 0.0f, r.turn_variance}}};
  Observation<float> z[M];
  for (int i = 0; i < M; ++i) z[i] = {i, r.z[i], 0.0025f};
  if (!filter.move(step, 0.0f)) return false;
  return filter.observe({}, z, M).outcome == EseifOutcome::applied;
}

}  // namespace embedded
