// The state of the information filter: the robot, the map, and what they share (paper section IV).
#pragma once

#include "vector_field_slam/eseif_dense.hpp"
#include "vector_field_slam/eseif_map.hpp"
#include "vector_field_slam/sensor_model.hpp"

namespace vector_field_slam {

/// Everything that must be kept between steps. The robot shares information with the four active
/// nodes only. Local variables are ordered: the 4 M values of the active nodes, then the robot.
template <class S, int M, class Map>
struct EseifState {
  static constexpr int kNodes = 4 * M;
  static constexpr int kLocal = kNodes + kRobot;
  static constexpr int kRobotPacked = kRobot * (kRobot + 1) / 2;

  Map map;
  S robot[kRobot] = {};              ///< mean of x, y, yaw, c_x, c_y
  S information[kRobotPacked] = {};  ///< Lambda_xx
  S cross[kRobot][kNodes] = {};      ///< Lambda_xM
  S drift[kNodes] = {};  ///< how far the active nodes' means went since the cell was entered
  std::int32_t active[4] = {-1, -1, -1, -1};  ///< node numbers, in cell_node order
  GridIndex cell;

  /// The block of Lambda that active nodes i < j share.
  S* shared(int i, int j) {
    constexpr int kDirection[3][4] = {{-1, 0, 1, 2}, {-1, -1, 3, 1}, {-1, -1, -1, 0}};
    return map.edge(map.node(active[i]).edge[kDirection[i][j]]);
  }

  /// Lambda_MM += sign sum_r x_r^T y_r over the active nodes; the sum is symmetric. @param x, y
  /// `rows` rows of kNodes numbers
  void add_products(const S (*x)[kNodes], const S (*y)[kNodes], int rows, S sign) {
    for (int i = 0; i < 4; ++i) {
      S* const own = map.node(active[i]).information;
      for (int r = 0; r < rows; ++r) {
        const S *const a = x[r] + i * M, *const b = y[r] + i * M;
        int k = 0;
        for (int p = 0; p < M; ++p) {
          const S f = sign * a[p];
          for (int q = p; q < M; ++q) own[k++] += f * b[q];
        }
      }
      for (int j = i + 1; j < 4; ++j) {
        S* const block = shared(i, j);
        for (int r = 0; r < rows; ++r) {
          const S *const a = x[r] + i * M, *const b = y[r] + j * M;
          for (int p = 0; p < M; ++p) {
            const S f = sign * a[p];
            for (int q = 0; q < M; ++q) block[p * M + q] += f * b[q];
          }
        }
      }
    }
  }

  /// Residuals of the active nodes -= rows^T factors.
  void subtract_from_residuals(const S (*rows)[kNodes], const S* factors, int count) {
    for (int i = 0; i < kNodes; ++i) {
      S sum = S(0);
      for (int r = 0; r < count; ++r) sum += rows[r][i] * factors[r];
      map.node(active[i / M]).residual[i % M] -= sum;
    }
  }

  /// Local part of Lambda, upper triangle, with row (and column) i of it at `row_of[i]` of `a`.
  /// @param a kLocal x kLocal, every upper entry set @param row_of ascending within each node
  void gather(S* a, const int* row_of) {
    for (int i = 0; i < 4; ++i) {
      const S* const own = map.node(active[i]).information;
      for (int p = 0; p < M; ++p) {
        for (int q = p; q < M; ++q) {
          put(a, row_of[i * M + p], row_of[i * M + q], own[packed(M, p, q)]);
        }
      }
      for (int j = i + 1; j < 4; ++j) {
        const S* const block = shared(i, j);
        for (int p = 0; p < M; ++p) {
          for (int q = 0; q < M; ++q) {
            put(a, row_of[i * M + p], row_of[j * M + q], block[p * M + q]);
          }
        }
      }
    }
    for (int r = 0; r < kRobot; ++r) {
      for (int i = 0; i < kNodes; ++i) put(a, row_of[i], row_of[kNodes + r], cross[r][i]);
      for (int c = r; c < kRobot; ++c) {
        put(a, row_of[kNodes + r], row_of[kNodes + c], information[packed(kRobot, r, c)]);
      }
    }
  }

  /// Lambda_xx in full.
  void robot_information(S* full) const {
    for (int i = 0; i < kRobot; ++i) {
      for (int j = i; j < kRobot; ++j) {
        full[i * kRobot + j] = full[j * kRobot + i] = information[packed(kRobot, i, j)];
      }
    }
  }
  void set_robot_information(const S* full) {
    for (int i = 0; i < kRobot; ++i) {
      for (int j = i; j < kRobot; ++j) information[packed(kRobot, i, j)] = full[i * kRobot + j];
    }
  }

 private:
  static void put(S* a, int i, int j, S value) {
    a[i < j ? i * kLocal + j : j * kLocal + i] = value;
  }
};

}  // namespace vector_field_slam
