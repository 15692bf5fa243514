// Eseif: motion, measurement and mean recovery within a cell.
#pragma once

#include "vector_field_slam/eseif.hpp"

namespace vector_field_slam {
namespace detail {

/// c := a b, or a b^T.
template <class S, int N>
void multiply(const S* a, const S* b, bool transposed, S* c) {
  for (int i = 0; i < N; ++i) {
    for (int j = 0; j < N; ++j) {
      S sum = S(0);
      for (int k = 0; k < N; ++k) sum += a[i * N + k] * (transposed ? b[j * N + k] : b[k * N + j]);
      c[i * N + j] = sum;
    }
  }
}

template <class S, int N>
void make_symmetric(S* a) {
  for (int i = 0; i < N; ++i) {
    for (int j = i + 1; j < N; ++j) {
      a[i * N + j] = a[j * N + i] = S(0.5) * (a[i * N + j] + a[j * N + i]);
    }
  }
}

/// G M, for G_x of eq. (49) over the pose and 1 over the calibration.
template <class S>
void turn_rows(S dx, S dy, S* m) {
  for (int k = 0; k < kRobot; ++k) {
    m[k] -= dy * m[2 * kRobot + k];
    m[kRobot + k] += dx * m[2 * kRobot + k];
  }
}
/// M G^T.
template <class S>
void turn_columns(S dx, S dy, S* m) {
  for (int k = 0; k < kRobot; ++k) {
    m[k * kRobot] -= dy * m[k * kRobot + 2];
    m[k * kRobot + 1] += dx * m[k * kRobot + 2];
  }
}

template <class S>
S wrapped(S yaw) {
  constexpr S kPi = S(3.14159265358979323846);
  while (yaw > kPi) yaw -= S(2) * kPi;
  while (yaw <= -kPi) yaw += S(2) * kPi;
  return yaw;
}

}  // namespace detail

template <class S, int M, class Map, int MaxRings>
bool Eseif<S, M, Map, MaxRings>::set_robot_covariance(const S* covariance) {
  S copy[kRobot * kRobot], information[kRobot * kRobot];
  for (int i = 0; i < kRobot * kRobot; ++i) copy[i] = covariance_[i] = covariance[i];
  if (!dense::invert<S, kRobot>(copy, information)) return false;
  state_.set_robot_information(information);
  return true;
}

// With X = G P G^T, P = Lambda_xx^-1 and A = R + X, the paper's Psi = G^-1 - G^-1 R A^-1 is
// P G^T A^-1, and P - Omega is G^-1 R A^-1 G P: the same without differences of large numbers. The
// second is written T below.
template <class S, int M, class Map, int MaxRings>
bool Eseif<S, M, Map, MaxRings>::move(const OdometryStep<S>& step, S calibration_variance) {
  constexpr int N = kRobot;
  S noise[N * N] = {}, work[N * N], p[N * N], gp[N * N], a[N * N], inverse[N * N];
  for (int i = 0; i < kPose; ++i) {
    for (int j = 0; j < kPose; ++j) noise[i * N + j] = step.noise[i][j];
  }
  for (int i = kPose; i < N; ++i) noise[i * N + i] = calibration_variance;

  state_.robot_information(work);
  if (!dense::invert<S, N>(work, p)) return false;
  for (int i = 0; i < N * N; ++i) gp[i] = p[i];
  detail::turn_rows(step.dx, step.dy, gp);  // G P
  for (int i = 0; i < N * N; ++i) a[i] = gp[i];
  detail::turn_columns(step.dx, step.dy, a);  // G P G^T
  for (int i = 0; i < N * N; ++i) a[i] += noise[i];
  if (!dense::invert<S, N>(a, inverse)) return false;

  S t[N * N], psi_t[N * N];
  detail::multiply<S, N>(inverse, gp, false, psi_t);  // Psi^T = A^-1 G P
  detail::multiply<S, N>(noise, psi_t, false, t);
  detail::turn_rows(-step.dx, -step.dy, t);  // T = G^-1 R A^-1 G P
  detail::make_symmetric<S, N>(t);

  S product[N][kNodes], turned[N][kNodes];
  for (int r = 0; r < N; ++r) {
    for (int i = 0; i < kNodes; ++i) product[r][i] = turned[r][i] = S(0);
    for (int k = 0; k < N; ++k) {
      for (int i = 0; i < kNodes; ++i) {
        product[r][i] += t[r * N + k] * state_.cross[k][i];
        turned[r][i] += psi_t[r * N + k] * state_.cross[k][i];
      }
    }
  }
  state_.add_products(state_.cross, product, N, S(-1));  // eq. (25)
  for (int r = 0; r < N; ++r) {
    for (int i = 0; i < kNodes; ++i) state_.cross[r][i] = turned[r][i];  // eq. (24)
  }
  state_.set_robot_information(inverse);  // eq. (23)

  state_.robot[0] += step.dx;
  state_.robot[1] += step.dy;
  state_.robot[2] = detail::wrapped(state_.robot[2] + step.dyaw);
  detail::turn_rows(step.dx, step.dy, covariance_);
  detail::turn_columns(step.dx, step.dy, covariance_);
  for (int i = 0; i < N * N; ++i) covariance_[i] += noise[i];
  detail::make_symmetric<S, N>(covariance_);
  return true;
}

template <class S, int M, class Map, int MaxRings>
typename Eseif<S, M, Map, MaxRings>::Report Eseif<S, M, Map, MaxRings>::observe(
    const Mounting<S>& mounting, const Observation<S>* readings, int count) {
  Report report;
  const SensorPose<S> sensor(state_.robot, mounting);
  GridIndex cell;
  if (!config_.grid.cell_of(sensor.x, sensor.y, cell)) {
    report.outcome = EseifOutcome::no_place;
    return report;
  }
  if (cell != state_.cell) {
    S values[M];
    const S* nodes[4];
    for (int j = 0; j < 4; ++j) nodes[j] = state_.map.node(state_.active[j]).mean;
    suggested_values(config_.sensor, config_.grid, sensor, state_.robot + kPose, readings, count,
                     nodes, values);
    report.outcome = enter(cell, values, report);
    if (report.outcome != EseifOutcome::applied) return report;
  }
  update(mounting, readings, count, report);
  return report;
}

/// Eq. (39) after the neighbourhood changed: solves for the local means, and the robot's
/// covariance.
template <class S, int M, class Map, int MaxRings>
bool Eseif<S, M, Map, MaxRings>::recover() {
  int row_of[kLocal];
  S step[kLocal];
  for (int i = 0; i < kLocal; ++i) row_of[i] = i;
  local_information(matrix_, row_of);
  for (int i = 0; i < kNodes; ++i) step[i] = state_.map.node(state_.active[i / M]).residual[i % M];
  for (int i = kNodes; i < kLocal; ++i) step[i] = S(0);
  if (!dense::eliminate(matrix_, kLocal, kLocal, kLocal)) return false;
  dense::forward(matrix_, kLocal, kLocal, step);
  dense::backward(matrix_, kLocal, kLocal, step);
  apply(step);
  return updated_covariance(matrix_, nullptr, nullptr, 0);
}

template <class S, int M, class Map, int MaxRings>
void Eseif<S, M, Map, MaxRings>::apply(const S* step) {
  for (int i = 0; i < kNodes; ++i) {
    auto& node = state_.map.node(state_.active[i / M]);
    node.mean[i % M] += step[i];
    node.residual[i % M] = S(0);
    state_.drift[i] += step[i];
  }
  for (int r = 0; r < kRobot; ++r) state_.robot[r] += step[kNodes + r];
  state_.robot[2] = detail::wrapped(state_.robot[2]);
}

// One factorization per measurement: with U of the information before the update and v = U^-T h for
// each row h of H, the innovation covariance is V V^T + Q (for the gate), the step of all local
// means is U^-1 V^T (V V^T + Q)^-1 (z - h), the solution of eq. (39) after eq. (16)-(17).
template <class S, int M, class Map, int MaxRings>
void Eseif<S, M, Map, MaxRings>::update(const Mounting<S>& mounting, const Observation<S>* readings,
                                        int count, Report& report) {
  int row_of[kLocal];
  for (int i = 0; i < kLocal; ++i) row_of[i] = i;
  local_information(matrix_, row_of);
  if (!dense::eliminate(matrix_, kLocal, kLocal, kLocal)) {
    report.outcome = EseifOutcome::not_positive;
    return;
  }
  Linearized rows;
  linearize(mounting, readings, count, rows);
  report.used = rows.used;
  report.gated = count - rows.used;
  if (rows.used == 0) {
    report.outcome = EseifOutcome::gated;
    return;
  }
  const bool good =
      correct(rows, report) && updated_covariance(matrix_, rows.v, rows.variance, rows.used);
  add_information(rows);
  if (!good) report.outcome = EseifOutcome::not_positive;
}

/// Rows of H at the means of now, for the readings inside the gate.
template <class S, int M, class Map, int MaxRings>
void Eseif<S, M, Map, MaxRings>::linearize(const Mounting<S>& mounting,
                                           const Observation<S>* readings, int count,
                                           Linearized& rows) const {
  const SensorPose<S> sensor(state_.robot, mounting);
  const Interpolation<S> at(config_.grid, state_.cell, sensor.x, sensor.y);
  const S* nodes[4];
  for (int j = 0; j < 4; ++j) nodes[j] = state_.map.node(state_.active[j]).mean;
  rows.used = 0;
  for (int k = 0; k < count; ++k) {
    const int row = rows.used, channel = readings[k].channel;
    const auto p = config_.sensor.predict(channel, sensor, state_.robot + kPose, at, nodes);
    node_row<S, M>(p, at, channel, rows.h_nodes[row]);
    S* const v = rows.v[row];
    for (int i = 0; i < kNodes; ++i) v[i] = rows.h_nodes[row][i];
    for (int r = 0; r < kRobot; ++r) rows.h_robot[row][r] = v[kNodes + r] = p.robot[r];
    dense::forward(matrix_, kLocal, kLocal, v);
    rows.variance[row] = readings[k].variance;
    if (config_.underweighting > S(0)) {
      rows.variance[row] +=
          config_.underweighting * curvature_variance({config_.sensor, channel, sensor, at, nodes});
    }
    S variance = rows.variance[row];
    for (int i = 0; i < kLocal; ++i) variance += v[i] * v[i];
    const S innovation = readings[k].value - p.value;
    rows.innovation[row] = innovation;
    const bool far_off = innovation * innovation > config_.gate * variance;
    if (!(config_.gate > S(0) && far_off)) ++rows.used;
  }
}

/// 1/2 tr(W P W P) with P = U^-1 U^-T, U in matrix_. O((4 M)^2)
template <class S, int M, class Map, int MaxRings>
S Eseif<S, M, Map, MaxRings>::curvature_variance(const Curvature<S, M>& curvature) const {
  const S* const corner = matrix_ + kNodes * kLocal + kNodes;  // of the robot, last in U
  S e[kPose][kRobot] = {}, a[kPose][kLocal], ee[kPose][kPose], ea[kPose][kPose], aa[kPose][kPose];
  for (int i = 0; i < kPose; ++i) {
    e[i][i] = S(1);
    dense::forward(corner, kRobot, kLocal, e[i]);
    for (int k = 0; k < kNodes; ++k) a[i][k] = curvature.nodes[i][k];
    for (int r = 0; r < kRobot; ++r) a[i][kNodes + r] = curvature.robot[i][r];
    dense::forward(matrix_, kLocal, kLocal, a[i]);
  }
  for (int i = 0; i < kPose; ++i) {
    for (int j = 0; j < kPose; ++j) {
      ee[i][j] = ea[i][j] = aa[i][j] = S(0);
      for (int r = 0; r < kRobot; ++r) {
        ee[i][j] += e[i][r] * e[j][r];
        ea[i][j] += e[i][r] * a[j][kNodes + r];
      }
      for (int k = 0; k < kLocal; ++k) aa[i][j] += a[i][k] * a[j][k];
    }
  }
  return Curvature<S, M>::variance(ee, ea, aa);
}

template <class S, int M, class Map, int MaxRings>
bool Eseif<S, M, Map, MaxRings>::correct(const Linearized& rows, Report& report) {
  S weights[M * M], y[M], step[kLocal] = {};  // (V V^T + Q)^-1 (z - h)
  for (int k = 0; k < rows.used; ++k) {
    y[k] = rows.innovation[k];
    for (int l = k; l < rows.used; ++l) {
      S sum = k == l ? rows.variance[k] : S(0);
      for (int i = 0; i < kLocal; ++i) sum += rows.v[k][i] * rows.v[l][i];
      weights[k * M + l] = sum;
    }
  }
  if (!dense::eliminate(weights, rows.used, M, rows.used)) return false;
  dense::forward(weights, rows.used, M, y);
  for (int k = 0; k < rows.used; ++k) report.nis += y[k] * y[k];
  dense::backward(weights, rows.used, M, y);
  for (int k = 0; k < rows.used; ++k) {
    for (int i = 0; i < kLocal; ++i) step[i] += rows.v[k][i] * y[k];
  }
  dense::backward(matrix_, kLocal, kLocal, step);
  apply(step);
  return true;
}

/// Eq. (17).
template <class S, int M, class Map, int MaxRings>
void Eseif<S, M, Map, MaxRings>::add_information(const Linearized& rows) {
  S scaled[M][kNodes];
  for (int k = 0; k < rows.used; ++k) {
    const S inverse = S(1) / rows.variance[k];
    for (int i = 0; i < kNodes; ++i) scaled[k][i] = inverse * rows.h_nodes[k][i];
    for (int r = 0; r < kRobot; ++r) {
      const S h = rows.h_robot[k][r];
      for (int i = 0; i < kNodes; ++i) state_.cross[r][i] += h * scaled[k][i];
      for (int c = r; c < kRobot; ++c) {
        state_.information[packed(kRobot, r, c)] += inverse * h * rows.h_robot[k][c];
      }
    }
  }
  state_.add_products(rows.h_nodes, scaled, rows.used, S(1));
}

/// Covariance of the robot, last in the factor U: U_xx^-1 (I + V_x W^-1 V_x^T)^-1 U_xx^-T, with
/// V_x the robot's columns of V and W = V_n V_n^T + Q what the nodes and the noise leave of the
/// innovation covariance. No differences: it stays positive definite.
template <class S, int M, class Map, int MaxRings>
bool Eseif<S, M, Map, MaxRings>::updated_covariance(const S* factor, const S (*v)[kLocal],
                                                    const S* variances, int count) {
  constexpr int N = kRobot;
  S inner[N * N] = {}, w[M * M], vx[M][N];
  for (int i = 0; i < N; ++i) inner[i * N + i] = S(1);
  for (int k = 0; k < count; ++k) {
    for (int l = k; l < count; ++l) {
      S sum = k == l ? variances[k] : S(0);
      for (int i = 0; i < kNodes; ++i) sum += v[k][i] * v[l][i];
      w[k * M + l] = sum;
    }
    for (int r = 0; r < N; ++r) vx[k][r] = v[k][kNodes + r];
  }
  if (!dense::eliminate(w, count, M, count)) return false;
  dense::forward(w, count, M, vx[0], N, N);
  for (int k = 0; k < count; ++k) {
    for (int i = 0; i < N; ++i) {
      for (int j = i; j < N; ++j) inner[i * N + j] += vx[k][i] * vx[k][j];
    }
  }
  if (!dense::eliminate(inner, N, N, N)) return false;
  // Columns of U_xx^-1 C^-1, inner = C^T C; the covariance is the product with its transpose.
  S root[N][N];
  for (int i = 0; i < N; ++i) {
    S column[N] = {};
    column[i] = S(1);
    dense::backward(inner, N, N, column);
    dense::backward(factor + kNodes * kLocal + kNodes, N, kLocal, column);
    for (int j = 0; j < N; ++j) root[j][i] = column[j];
  }
  for (int i = 0; i < N; ++i) {
    for (int j = 0; j <= i; ++j) {
      S sum = S(0);
      for (int k = 0; k < N; ++k) sum += root[i][k] * root[j][k];
      covariance_[i * N + j] = covariance_[j * N + i] = sum;
    }
  }
  return true;
}

template <class S, int M, class Map, int MaxRings>
bool Eseif<S, M, Map, MaxRings>::resume(const S* covariance) {
  S drift[kNodes];
  for (int i = 0; i < kNodes; ++i) drift[i] = state_.drift[i];
  for (int i = 0; i < kRobot * kRobot; ++i) covariance_[i] = covariance[i];
  // Residuals of the active nodes were folded in when the cell was entered, and are zero since.
  if (!window_.condense(state_, config_.rings)) return false;
  for (int i = 0; i < kNodes; ++i) {
    state_.map.node(state_.active[i / M]).residual[i % M] = S(0);
    state_.drift[i] = drift[i];
  }
  return true;
}

}  // namespace vector_field_slam
