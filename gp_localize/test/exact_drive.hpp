// A robot with exact odometry on a widening circle, for tests of what is learned besides the map.
#pragma once

#include "gp_localize/gp_localize.hpp"

namespace gp_localize {

constexpr int kSlice = 6;

/// One field, `light`; no resampling: weights are evidence.
inline GpLocalizeParams exact_params() {
  GpLocalizeParams p;
  FieldParams f;
  f.mean = 3.0;
  f.signal_stddev = 1.0;
  f.noise_stddev = 0.2;
  f.length_scales = {1.5, 2.0};
  p.fields = {{"light", f}};
  p.slice_size = kSlice;
  p.likelihood_noise_scale = 1.0;
  p.resample_threshold = 0.0;
  p.diversity.paths = 0;
  p.support.region = {-3.0, -1.0, 3.0, 5.0};
  p.support.size = 25;
  p.support.jitter = 1e-6;
  p.odometry_noise = {0.0, 0.0, 0.0, 0.0};
  p.initial_cov_xx = p.initial_cov_yy = p.initial_cov_aa = 0.0;
  return p;
}

/// The same with particles that spread and are resampled, for states.
inline GpLocalizeParams resampling(GpLocalizeParams p) {
  p.particles = 60;
  p.resample_threshold = 0.5;
  p.odometry_noise = {0.01, 0.01, 0.01, 0.01};
  return p;
}

inline field_core::SE2 exact_motion(int step) { return {0.25 + 0.002 * step, 0.0, 0.15}; }

}  // namespace gp_localize
