#include "gp_localize/support_set.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "field_core/errors.hpp"
#include "gp_localize/survey.hpp"

namespace gp_localize {
namespace {

using field_core::Place;
using field_core::Places;

/// Cell centres of columns x rows cells over the region, row by row.
Eigen::Matrix2Xd lattice(const std::vector<double>& r, int columns, int rows) {
  Eigen::Matrix2Xd points(2, columns * rows);
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      points.col(j * columns + i) << r[0] + (r[2] - r[0]) * (i + 0.5) / columns,
          r[1] + (r[3] - r[1]) * (j + 0.5) / rows;
    }
  }
  return points;
}

/// Of all grids with at most `size` cells, the one that fills the most and is the most square.
Eigen::Matrix2Xd grid(const std::vector<double>& r, int size) {
  const double width = r[2] - r[0], height = r[3] - r[1];
  int best_columns = 1, best_rows = size;
  double best_cost = std::numeric_limits<double>::infinity();
  for (int columns = 1; columns <= size; ++columns) {
    const int rows = size / columns;
    const double squareness = std::abs(std::log((width / columns) / (height / rows)));
    const double cost = squareness + 2.0 * std::log(static_cast<double>(size) / (columns * rows));
    if (cost < best_cost) {
      best_cost = cost;
      best_columns = columns;
      best_rows = rows;
    }
  }
  return lattice(r, best_columns, best_rows);
}

Eigen::Matrix2Xd candidates(const std::vector<double>& r) {
  constexpr int kCandidates = 400;
  return grid(r, kCandidates);
}

Places pick(const Places& from, const std::vector<Eigen::Index>& chosen) {
  Places points(from.rows(), chosen.size());
  for (std::size_t i = 0; i < chosen.size(); ++i) points.col(i) = from.col(chosen[i]);
  return points;
}

Eigen::Matrix2Xd places_of_survey(const std::string& path) {
  SurveyBuilder all;
  for (const auto& [name, field] : read_survey(path, {})) {
    for (Eigen::Index i = 0; i < field.values.size(); ++i) all.add("", field.places.col(i), 0.0);
  }
  return all.build().at("").places;
}

}  // namespace

/// Greedy choice of argmax var(y | chosen) / var(y | all others): each ratio from one covariance
/// that is conditioned step by step, and from the precision of the places not chosen yet.
Places most_informative(const Places& all, int size, const field_core::Kernel& kernel,
                        double noise_variance) {
  Eigen::MatrixXd given_chosen = kernel.matrix(all, all);
  given_chosen.diagonal().array() += noise_variance;
  const Eigen::Index n = all.cols();
  Eigen::MatrixXd precision = given_chosen.llt().solve(Eigen::MatrixXd::Identity(n, n));
  std::vector<Eigen::Index> chosen;
  std::vector<bool> taken(n, false);
  while (static_cast<Eigen::Index>(chosen.size()) < std::min<Eigen::Index>(size, n - 1)) {
    Eigen::Index best = -1;
    double best_ratio = -1.0;
    for (Eigen::Index y = 0; y < n; ++y) {
      // var(y | others not chosen) = 1 / precision(y, y).
      const double ratio = taken[y] ? -1.0 : given_chosen(y, y) * precision(y, y);
      if (ratio > best_ratio * (1.0 + 1e-12)) {
        best_ratio = ratio;
        best = y;
      }
    }
    chosen.push_back(best);
    taken[best] = true;
    const Eigen::VectorXd c = given_chosen.col(best);
    given_chosen.noalias() -= c * c.transpose() / c[best];
    // Marginalizing `best` out of the places that remain: a Schur complement of the precision.
    const Eigen::VectorXd p = precision.col(best);
    precision.noalias() -= p * p.transpose() / p[best];
  }
  return pick(all, chosen);
}

Places spread_over(const Places& places, const Place& start, int size) {
  std::vector<Eigen::Index> chosen(1);
  (places.colwise() - start).colwise().squaredNorm().minCoeff(&chosen[0]);
  Eigen::RowVectorXd nearest = (places.colwise() - places.col(chosen[0])).colwise().squaredNorm();
  constexpr double kSame = 1e-6;  // of the extent, squared: a place measured twice
  const double least = kSame * kSame * nearest.maxCoeff();
  while (static_cast<int>(chosen.size()) < size) {
    Eigen::Index next;
    if (nearest.maxCoeff(&next) <= least) break;
    chosen.push_back(next);
    nearest = nearest.cwiseMin((places.colwise() - places.col(next)).colwise().squaredNorm());
  }
  return pick(places, chosen);
}

Places select_support(const SupportParams& params, const field_core::Kernel& kernel,
                      double noise_variance, const std::string& survey) {
  const auto& r = params.region;
  const Eigen::Vector2d centre((r[0] + r[2]) / 2, (r[1] + r[3]) / 2);
  switch (params.selection) {
    case SupportSelection::grid:
      return grid(params.region, params.size);
    case SupportSelection::farthest_point:
      return spread_over(candidates(params.region), centre, params.size);
    case SupportSelection::survey: {
      const Places places = places_of_survey(survey);
      return spread_over(places, places.rowwise().mean(), params.size);
    }
    case SupportSelection::mutual_information:
      return most_informative(candidates(params.region), params.size, kernel, noise_variance);
    case SupportSelection::explicit_points:
      break;
  }
  if (params.points.empty()) {
    throw field_core::ParameterError("support/points",
                                     "selection: explicit needs a list of points [[x, y], ...]");
  }
  Eigen::Matrix2Xd points(2, params.points.size());
  for (std::size_t i = 0; i < params.points.size(); ++i) points.col(i) = params.points[i];
  return points;
}

}  // namespace gp_localize
