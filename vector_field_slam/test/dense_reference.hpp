// The exactly sparse filter as the paper writes it: dense eta and Lambda, whole matrices inverted,
// the mean of cell and ring recovered in every step. Slow, and shares no code with eseif_*.hpp.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <vector>

#include "vector_field_slam/eseif_config.hpp"
#include "vector_field_slam/model.hpp"
#include "vector_field_slam/solver.hpp"

namespace dense_reference {

using namespace vector_field_slam;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Rows and columns of a matrix, entries of a vector.
inline MatrixXd pick(const MatrixXd& a, const std::vector<int>& r, const std::vector<int>& c) {
  MatrixXd result(r.size(), c.size());
  for (std::size_t i = 0; i < r.size(); ++i) {
    for (std::size_t j = 0; j < c.size(); ++j) result(i, j) = a(r[i], c[j]);
  }
  return result;
}
inline VectorXd pick(const VectorXd& a, const std::vector<int>& r) {
  VectorXd result(r.size());
  for (std::size_t i = 0; i < r.size(); ++i) result[i] = a[r[i]];
  return result;
}
inline std::vector<int> without(const std::vector<int>& all, const std::vector<int>& some) {
  std::vector<int> rest;
  for (int i : all) {
    if (std::find(some.begin(), some.end(), i) == some.end()) rest.push_back(i);
  }
  return rest;
}
inline std::vector<int> join(std::vector<int> a, const std::vector<int>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

template <int M>
struct Filter {
  const Model<M>& model;
  Relocation relocation;
  int rings;
  VectorXd r0 = VectorXd::Zero(kRobot);
  VectorXd eta{}, mu{};
  MatrixXd lambda{}, robot_covariance{};
  std::vector<GridIndex> nodes{};
  GridIndex cell{};

  int find(GridIndex i) const {
    const auto n = std::find(nodes.begin(), nodes.end(), i);
    return n == nodes.end() ? -1 : static_cast<int>(n - nodes.begin());
  }
  std::vector<int> robot() const { return {0, 1, 2, 3, 4}; }
  std::vector<int> variables(int node) const {
    std::vector<int> v;
    for (int i = 0; i < M; ++i) v.push_back(kRobot + M * node + i);
    return v;
  }
  std::vector<int> variables(const std::vector<int>& some) const {
    std::vector<int> v;
    for (int n : some) v = join(v, variables(n));
    return v;
  }
  std::vector<int> all() const {
    std::vector<int> v(mu.size());
    for (std::size_t i = 0; i < v.size(); ++i) v[i] = static_cast<int>(i);
    return v;
  }
  std::vector<int> cell_nodes(GridIndex c) const {
    std::vector<int> v;
    for (int j = 0; j < 4; ++j) v.push_back(find(cell_node(c, j)));
    return v;
  }
  /// Known nodes of the rings around a cell.
  std::vector<int> ring_nodes(GridIndex c) const {
    std::vector<int> v;
    for (int y = -rings; y <= 1 + rings; ++y) {
      for (int x = -rings; x <= 1 + rings; ++x) {
        if ((x == 0 || x == 1) && (y == 0 || y == 1)) continue;
        if (find(offset(c, x, y)) >= 0) v.push_back(find(offset(c, x, y)));
      }
    }
    return v;
  }

  void start(const StartState& s) {
    nodes.clear();
    cell = s.cell;
    mu = s.robot;
    lambda = s.covariance.inverse();
    for (int j = 0; j < 4; ++j) {
      MatrixXd information = MatrixXd::Zero(M, M);
      for (int i = 0; i < M; ++i) information(i, i) = 1.0 / model.prior_variance[i];
      append(cell_node(cell, j), s.node_values.col(j), information);
    }
    eta = lambda * mu;
    recover();
  }

  void append(GridIndex index, const VectorXd& mean, const MatrixXd& information) {
    const Eigen::Index n = mu.size();
    nodes.push_back(index);
    mu.conservativeResize(n + M);
    mu.tail(M) = mean;
    lambda.conservativeResize(n + M, n + M);
    lambda.bottomRows(M).setZero();
    lambda.rightCols(M).setZero();
    lambda.bottomRightCorner(M, M) = information;
    eta.conservativeResize(n + M);
    eta.tail(M) = information * mean;
  }

  /// Eq. (19)-(29) as printed, with x = {pose} and everything else, c included, in M.
  void move(const OdometryStep<double>& step) {
    const std::vector<int> x = {0, 1, 2}, m = without(all(), x);
    double g_values[3][3];
    step.jacobian(g_values);
    Eigen::Matrix3d g, r;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        g(i, j) = g_values[i][j];
        r(i, j) = step.noise[i][j];
      }
    }
    const MatrixXd xx = pick(lambda, x, x), xm = pick(lambda, x, m), mm = pick(lambda, m, m);
    const VectorXd eta_x = pick(eta, x), eta_m = pick(eta, m), mu_x = pick(mu, x);
    const VectorXd moved = mu_x + Eigen::Vector3d(step.dx, step.dy, step.dyaw);
    const MatrixXd inner = (r + g * xx.inverse() * g.transpose()).inverse();
    const VectorXd delta = moved - g * mu_x;                                         // (26)
    const MatrixXd psi = g.inverse() - g.inverse() * r * inner;                      // (27)
    const MatrixXd omega = xx.inverse() * g.transpose() * inner * g * xx.inverse();  // (28)
    const VectorXd new_eta_x = psi.transpose() * eta_x + inner * delta;              // (21)
    const VectorXd new_eta_m =
        eta_m - xm.transpose() * (xx.inverse() * eta_x - omega * eta_x - psi * delta);  // (22)
    const MatrixXd new_mm = mm - xm.transpose() * (xx.inverse() - omega) * xm;          // (25)
    const MatrixXd new_xm = psi.transpose() * xm;                                       // (24)
    put(x, x, inner);
    put(x, m, new_xm);
    put(m, x, new_xm.transpose());
    put(m, m, new_mm);
    for (std::size_t i = 0; i < x.size(); ++i) {
      eta[x[i]] = new_eta_x[i];
      mu[x[i]] = moved[i];
    }
    for (std::size_t i = 0; i < m.size(); ++i) eta[m[i]] = new_eta_m[i];
    MatrixXd full = MatrixXd::Identity(kRobot, kRobot), noise = MatrixXd::Zero(kRobot, kRobot);
    full.topLeftCorner(3, 3) = g;
    noise.topLeftCorner(3, 3) = r;
    robot_covariance = full * robot_covariance * full.transpose() + noise;
  }
  void put(const std::vector<int>& r, const std::vector<int>& c, const MatrixXd& a) {
    for (std::size_t i = 0; i < r.size(); ++i) {
      for (std::size_t j = 0; j < c.size(); ++j) lambda(r[i], c[j]) = a(i, j);
    }
  }
  void observe(const Mounting<double>& mounting, const std::vector<Observation<double>>& z) {
    const SensorPose<double> sensor(mu.data(), mounting);
    GridIndex now;
    model.grid.cell_of(sensor.x, sensor.y, now);
    if (now != cell) enter(now);
    const SensorPose<double> same(mu.data(), mounting);
    const auto active = cell_nodes(cell);
    const auto local = join(robot(), variables(active));
    const double* values[4];
    for (int j = 0; j < 4; ++j) values[j] = mu.data() + kRobot + M * active[j];
    const Interpolation<double> at(model.grid, cell, same.x, same.y);
    MatrixXd h(z.size(), mu.size());
    h.setZero();
    VectorXd innovation(z.size());
    MatrixXd q = MatrixXd::Zero(z.size(), z.size());
    for (std::size_t k = 0; k < z.size(); ++k) {
      double row[kRobot + 4 * M];
      const auto p = model.sensor.predict(z[k].channel, same, mu.data() + kPose, at, values);
      local_row<double, M>(p, at, z[k].channel, row);
      for (std::size_t i = 0; i < local.size(); ++i) h(k, local[i]) = row[i];
      innovation[k] = z[k].value - p.value;
      q(k, k) = z[k].variance;
    }
    eta += h.transpose() * q.inverse() * (innovation + h * mu);  // (16)
    lambda += h.transpose() * q.inverse() * h;                   // (17)
    recover();
  }

  /// Eq. (39) over robot, cell and rings.
  void recover() {
    // Rounding must not make it unsymmetric: that grows from step to step.
    lambda = (0.5 * (lambda + lambda.transpose())).eval();
    const auto l = join(join(robot(), variables(cell_nodes(cell))), variables(ring_nodes(cell)));
    const auto b = without(all(), l);
    VectorXd right = pick(eta, l);
    if (!b.empty()) right -= pick(lambda, l, b) * pick(mu, b);
    const MatrixXd inverse = pick(lambda, l, l).inverse();
    const VectorXd solved = inverse * right;
    for (std::size_t i = 0; i < l.size(); ++i) mu[l[i]] = solved[i];
    robot_covariance = inverse.topLeftCorner(kRobot, kRobot);
  }

  /// Eq. (44) for one node, over its neighbours.
  MatrixXd node_covariance(int node) const {
    std::vector<int> blanket;
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        const int n = find(offset(nodes[node], x, y));
        if (n >= 0 && n != node) blanket.push_back(n);
      }
    }
    const auto own = variables(node), around = variables(blanket);
    const MatrixXd between = pick(lambda, own, around);
    return (pick(lambda, own, own) -
            between * pick(lambda, around, around).inverse() * between.transpose())
        .inverse();
  }

  /// Relocation::window in covariance form: joint covariance of the window given all beyond, the
  /// new nodes appended by eq. (14), then the conditional of (robot, new nodes) on the cell's known
  /// nodes.
  void enter_window(GridIndex next) {
    const auto window_nodes = join(cell_nodes(cell), ring_nodes(cell));
    std::vector<GridIndex> places;  // of the nodes in `covariance`, after the robot
    for (int n : window_nodes) places.push_back(nodes[n]);
    MatrixXd covariance =
        pick(lambda, join(robot(), variables(window_nodes)), join(robot(), variables(window_nodes)))
            .inverse();
    const auto lookup = [&](GridIndex i) {
      const auto n = std::find(places.begin(), places.end(), i);
      return n == places.end() ? -1 : static_cast<int>(n - places.begin());
    };
    std::vector<int> free = robot();
    std::vector<GridIndex> added;
    for (;;) {
      const NewNode n = next_new_node(next, lookup);
      if (n.source.near < 0) break;  // all there: these tests never jump
      const MatrixXd e = factors(), a2 = e + MatrixXd::Identity(M, M);
      MatrixXd f = MatrixXd::Zero(M, covariance.rows());
      f.middleCols(kRobot + M * n.source.far, M) = -e;
      f.middleCols(kRobot + M * n.source.near, M) = a2;
      const Eigen::Index size = covariance.rows();
      MatrixXd grown(size + M, size + M);
      grown << covariance, covariance * f.transpose(), f * covariance,
          f * covariance * f.transpose() + noise();
      covariance = grown;
      places.push_back(n.index);
      added.push_back(n.index);
      for (int i = 0; i < M; ++i) free.push_back(static_cast<int>(size) + i);
      const auto known = [this](GridIndex i) { return find(i); };
      const auto source = extrapolation_source(n.index, known);
      const VectorXd mean =
          a2 * pick(mu, variables(source.near)) - e * pick(mu, variables(source.far));
      append(n.index, mean, MatrixXd::Zero(M, M));
    }
    std::vector<int> given, given_here;
    for (int j = 0; j < 4; ++j) {
      const GridIndex index = cell_node(next, j);
      if (std::find(added.begin(), added.end(), index) != added.end()) continue;
      given = join(given, variables(find(index)));
      for (int i = 0; i < M; ++i) given_here.push_back(kRobot + M * lookup(index) + i);
    }
    std::vector<int> x = robot();
    for (GridIndex i : added) x = join(x, variables(find(i)));
    const MatrixXd cross = pick(covariance, free, given_here);
    const MatrixXd f = cross * pick(covariance, given_here, given_here).inverse();
    const MatrixXd rest = pick(covariance, free, free) - f * cross.transpose();
    marginalize_robot();
    cell = next;
    augment(x, given, f, rest);
    recover();
  }

  void enter(GridIndex next) {
    if (relocation == Relocation::window) return enter_window(next);
    // The robot's conditional, from the covariance of robot, cell and rings given all else.
    const auto old = cell_nodes(cell);
    const auto window = join(join(robot(), variables(old)), variables(ring_nodes(cell)));
    const MatrixXd covariance = pick(lambda, window, window).inverse();
    std::vector<int> shared, places;  // node numbers; rows of `covariance`
    for (int j = 0; j < 4 && relocation == Relocation::shared_nodes; ++j) {
      const GridIndex i = cell_node(cell, j);
      if (i.x < next.x || i.x > next.x + 1 || i.y < next.y || i.y > next.y + 1) continue;
      shared.push_back(old[j]);
      for (int k = 0; k < M; ++k) places.push_back(kRobot + M * j + k);
    }
    MatrixXd f = MatrixXd::Zero(kRobot, places.size());
    MatrixXd rest = pick(covariance, robot(), robot());
    if (!places.empty()) {
      const MatrixXd cross = pick(covariance, robot(), places);
      f = cross * pick(covariance, places, places).inverse();  // F_M of eq. (36)
      rest -= f * cross.transpose();                           // R_x
    }
    if (relocation == Relocation::blank) rest = robot_covariance + MatrixXd(r0.asDiagonal());

    marginalize_robot();
    add_nodes(next);
    cell = next;
    augment(robot(), variables(shared), f, rest);
    recover();
  }

  /// Eq. (31)-(32).
  void marginalize_robot() {
    const auto m = without(all(), robot());
    const MatrixXd xx = pick(lambda, robot(), robot()), xm = pick(lambda, robot(), m);
    const VectorXd eta_m = pick(eta, m) - xm.transpose() * xx.inverse() * pick(eta, robot());
    put(m, m, pick(lambda, m, m) - xm.transpose() * xx.inverse() * xm);
    for (std::size_t i = 0; i < m.size(); ++i) eta[m[i]] = eta_m[i];
    put(robot(), m, MatrixXd::Zero(kRobot, m.size()));
    put(m, robot(), MatrixXd::Zero(m.size(), kRobot));
    put(robot(), robot(), MatrixXd::Zero(kRobot, kRobot));
    eta.head(kRobot).setZero();
  }

  /// Eq. (34)-(35): x = F s + d + N(0, rest), with d such that the means stay.
  void augment(const std::vector<int>& x, const std::vector<int>& s, const MatrixXd& f,
               const MatrixXd& rest) {
    const MatrixXd information = rest.inverse();
    VectorXd d = pick(mu, x);
    if (!s.empty()) d -= f * pick(mu, s);
    add(x, x, information, information * d);
    if (s.empty()) return;
    put(x, s, -information * f);
    put(s, x, -f.transpose() * information);
    add(s, s, f.transpose() * information * f, -f.transpose() * information * d);
  }
  void add(const std::vector<int>& r, const std::vector<int>& c, const MatrixXd& a,
           const VectorXd& b) {
    put(r, c, pick(lambda, r, c) + a);
    for (std::size_t i = 0; i < r.size(); ++i) eta[r[i]] += b[i];
  }

  MatrixXd factors() const {
    MatrixXd e(M, M);
    for (int a = 0; a < M; ++a) {
      for (int b = 0; b < M; ++b) e(a, b) = model.extrapolation.e[a][b];
    }
    return e;
  }
  MatrixXd noise() const { return VectorXd::Map(model.extrapolation_variance, M).asDiagonal(); }

  void add_nodes(GridIndex next) {
    const auto lookup = [this](GridIndex i) { return find(i); };
    for (int j = 0; j < 4; ++j) {
      const NewNode n = next_new_node(next, lookup);
      if (n.source.near < 0) return;  // all there: these tests never jump
      const MatrixXd e = factors(), a2 = e + MatrixXd::Identity(M, M);
      const MatrixXd covariance = e * node_covariance(n.source.far) * e.transpose() +
                                  a2 * node_covariance(n.source.near) * a2.transpose() + noise();
      const VectorXd far = pick(mu, variables(n.source.far)),
                     near = pick(mu, variables(n.source.near));
      MatrixXd information = covariance.inverse();
      for (int a = 0; a < M; ++a) information(a, a) += 1.0 / model.prior_variance[a];
      append(n.index, a2 * near - e * far, information);
    }
  }
};

}  // namespace dense_reference
