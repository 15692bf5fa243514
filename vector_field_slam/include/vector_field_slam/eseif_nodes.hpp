// What one node is known to be, from the information around it: eq. (44).
#pragma once

#include "vector_field_slam/eseif_state.hpp"

namespace vector_field_slam {

/// Information that some nodes share, upper triangle. O(members^2 + M^2 edges)
/// @param a square with n >= M members rows, stride n: set, the rows beyond to zero
template <class S, int M, class Map>
void assemble_members(const Map& map, const int* members, int count, S* a, int n) {
  for (int i = 0; i < n * n; ++i) a[i] = S(0);
  for (int k = 0; k < count; ++k) {
    const auto& own = map.node(members[k]);
    for (int p = 0; p < M; ++p) {
      for (int q = p; q < M; ++q) {
        a[(k * M + p) * n + k * M + q] = own.information[packed(M, p, q)];
      }
    }
    for (int l = 0; l < count; ++l) {
      const int d = forward_direction(own.index, map.node(members[l]).index);
      if (d < 0 || own.edge[d] == Map::kNoEdge) continue;
      const S* const block = map.edge(own.edge[d]);
      for (int p = 0; p < M; ++p) {
        for (int q = 0; q < M; ++q) {
          const int i = k * M + p, j = l * M + q;
          a[i < j ? i * n + j : j * n + i] = block[p * M + q];
        }
      }
    }
  }
}

/// Covariance of one node given everything beyond its Markov blanket: its (at most 8) neighbours
/// are marginalized out. The robot must not share information with the map. O((8 M)^3)
/// @param scratch 9 M x 9 M numbers @param covariance M x M, set
/// @return false if the information is not positive definite
template <class S, int M, class Map>
bool node_covariance(const Map& map, int node, S* scratch, S* covariance) {
  int members[9], count = 0;
  const GridIndex centre = map.node(node).index;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      if (dx == 0 && dy == 0) continue;
      const int neighbour = map.find(offset(centre, dx, dy));
      if (neighbour >= 0) members[count++] = neighbour;
    }
  }
  members[count++] = node;  // last: what remains
  const int n = count * M;
  assemble_members<S, M>(map, members, count, scratch, n);
  if (!dense::eliminate(scratch, n, n, n - M)) return false;
  S rest[M * M];
  for (int p = 0; p < M; ++p) {
    for (int q = p; q < M; ++q) rest[p * M + q] = scratch[(n - M + p) * n + n - M + q];
  }
  return dense::invert<S, M>(rest, covariance);
}

/// Eq. (14): mean and covariance of a new node from two known ones, whose correlation is not known
/// and taken as none. @param e factors E @param noise diagonal of S @param covariance M x M, set
template <class S, int M>
void extrapolated_covariance(const S (*e)[M], const S* far, const S* near, const S* noise,
                             S* covariance) {
  for (int i = 0; i < M; ++i) {
    for (int j = 0; j < M; ++j) {
      S sum = i == j ? noise[i] : S(0);
      for (int k = 0; k < M; ++k) {
        const S near_i = e[i][k] + (i == k ? S(1) : S(0));
        for (int l = 0; l < M; ++l) {
          const S near_j = e[j][l] + (j == l ? S(1) : S(0));
          sum += e[i][k] * far[k * M + l] * e[j][l] + near_i * near[k * M + l] * near_j;
        }
      }
      covariance[i * M + j] = sum;
    }
  }
}

/// Eq. (14) exactly, in terms of information: adds that of m_new - A1 m_far - A2 m_near ~ N(0, S).
/// @param rows where the values of far, near and new node begin in `a` (upper triangle, stride n)
template <class S, int M>
void add_extrapolation(const S (*e)[M], const S* noise, const int* rows, S* a, int n) {
  for (int k = 0; k < M; ++k) {  // one row of the residual at a time
    S coefficients[3][M];
    for (int i = 0; i < M; ++i) {
      coefficients[0][i] = e[k][i];
      coefficients[1][i] = -e[k][i] - (i == k ? S(1) : S(0));
      coefficients[2][i] = i == k ? S(1) : S(0);
    }
    const S weight = S(1) / noise[k];
    for (int b = 0; b < 3 * M; ++b) {
      for (int c = 0; c < 3 * M; ++c) {
        const int i = rows[b / M] + b % M, j = rows[c / M] + c % M;
        if (i > j) continue;
        a[i * n + j] += weight * coefficients[b / M][b % M] * coefficients[c / M][c % M];
      }
    }
  }
}

}  // namespace vector_field_slam
