// The linear field around the start that the first measurements suggest: paper eq. (12), RANSAC.
#pragma once

#include <cmath>
#include <cstdint>

namespace vector_field_slam {

/// A field value seen at a place: SensorModel::field_value of a reading.
template <class S>
struct FieldSample {
  S x, y;    ///< [m], relative to node (0, 0)
  S value;   ///< field unit
  S stddev;  ///< noise of `value`, > 0
};

/// value at (x, y) = mean + slope_x (x - x0) + slope_y (y - y0).
template <class S>
struct LinearField {
  S mean = S(0), x0 = S(0), y0 = S(0), slope_x = S(0), slope_y = S(0);
  S at(S x, S y) const { return mean + slope_x * (x - x0) + slope_y * (y - y0); }
};

/// Robust fit of a linear field: the plane through three samples that most samples agree with
/// (within three standard deviations), then least squares over those (Fischler and Bolles 1981).
/// Slopes have the prior N(0, slope_stddev^2), so that samples on a line or at one place give the
/// plane without slope across. Deterministic; complexity O(count).
template <class S>
class LinearStart {
 public:
  static constexpr int kTrials = 60;

  /// @param samples count > 0 of them
  /// @param slope_stddev > 0 [field unit / m]
  static LinearField<S> fit(const FieldSample<S>* samples, int count, S slope_stddev) {
    LinearField<S> best = least_squares(samples, count, slope_stddev, [](int) { return true; });
    int most = agreeing(samples, count, best);
    std::uint32_t random = 1u;
    for (int trial = 0; trial < kTrials && most < count; ++trial) {
      int three[3];
      for (int& i : three) i = draw(random, count);
      const LinearField<S> f = least_squares(samples, count, slope_stddev, [&](int i) {
        return i == three[0] || i == three[1] || i == three[2];
      });
      const int agree = agreeing(samples, count, f);
      if (agree > most) {
        most = agree;
        best = f;
      }
    }
    if (most == 0) return best;
    return least_squares(samples, count, slope_stddev,
                         [&](int i) { return agrees(samples[i], best); });
  }

 private:
  static int draw(std::uint32_t& state, int count) {  // Numerical Recipes' linear congruence
    state = state * 1664525u + 1013904223u;
    return static_cast<int>((state >> 8) % static_cast<std::uint32_t>(count));
  }
  static bool agrees(const FieldSample<S>& s, const LinearField<S>& f) {
    return std::abs(s.value - f.at(s.x, s.y)) <= S(3) * s.stddev;
  }
  static int agreeing(const FieldSample<S>* samples, int count, const LinearField<S>& f) {
    int n = 0;
    for (int i = 0; i < count; ++i) n += agrees(samples[i], f);
    return n;
  }

  template <class Chosen>
  static LinearField<S> least_squares(const FieldSample<S>* samples, int count, S slope_stddev,
                                      const Chosen& chosen) {
    LinearField<S> f;
    S weight = S(0);
    for (int i = 0; i < count; ++i) {
      if (!chosen(i)) continue;
      const S w = S(1) / (samples[i].stddev * samples[i].stddev);
      weight += w;
      f.x0 += w * samples[i].x;
      f.y0 += w * samples[i].y;
      f.mean += w * samples[i].value;
    }
    f.x0 /= weight;
    f.y0 /= weight;
    f.mean /= weight;
    const S prior = S(1) / (slope_stddev * slope_stddev);
    S xx = prior, yy = prior, xy = S(0), xv = S(0), yv = S(0);
    for (int i = 0; i < count; ++i) {
      if (!chosen(i)) continue;
      const S w = S(1) / (samples[i].stddev * samples[i].stddev);
      const S dx = samples[i].x - f.x0, dy = samples[i].y - f.y0, dv = samples[i].value - f.mean;
      xx += w * dx * dx;
      xy += w * dx * dy;
      yy += w * dy * dy;
      xv += w * dx * dv;
      yv += w * dy * dv;
    }
    const S determinant = xx * yy - xy * xy;
    f.slope_x = (yy * xv - xy * yv) / determinant;
    f.slope_y = (xx * yv - xy * xv) / determinant;
    return f;
  }
};

}  // namespace vector_field_slam
