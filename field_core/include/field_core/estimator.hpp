// The requirements that every estimator of the suite meets, written once.
//
// An estimator E is a class without ROS, used by one thread at a time:
//
//   E::Params                                       struct declared as params.hpp says
//   static constexpr const char* E::kName           the package's name
//   E(const Params&, std::uint64_t seed)            @throws ParameterError
//   void predict(const OdometryIncrement&)          motion since the last predict
//   UpdateResult update(const Sample&)              one measurement, taken where predict() left off
//   Belief belief() const
//   FieldPrediction predict_field(points) const     mean and variance of each field at 2 x n points
//   const std::vector<FieldInfo>& fields() const    Reading::field indexes it
//   MapRegion map_region() const                    the area worth drawing
//   void set_pose(const SE2&, const Matrix3d& cov)  /initialpose; the map is kept
//   void scatter()                                  global_localization: the pose is unknown
//   void reset()                                    back to the state after construction
//   State state() const
//   void restore(const State&)                      complete: what follows is bit for bit the same;
//                                                   @throws DataError and changes nothing then
//
// and, if it has something to tell:
//
//   Health health() const                           whether it knows where the robot is
//   std::vector<HyperparameterPosterior> hyperparameters() const   what it believes of them
//   static std::vector<std::string> run_parameters()  keys of Params (or groups) that a state does
//                                                   not depend on: it may be restored under others
//   UpdateResult observe_position(const PositionObservation&)   where the robot was seen from
//   outside
//   void set_obstacles(const OccupancyMask&)        walls, which fields do not pass; everything
//                                                   starts again with them, and reset() keeps them
//
// If several robots share its fields:
//
//   const std::vector<std::string>& robots() const  their names, one at least. predict, update,
//                                                   belief, set_pose, scatter, observe_position and
//                                                   health then take the index of a robot as a
//                                                   further, last argument; without it they mean 0
//
// The same calls with the same seed give the same bits, whatever the machine's speed or load.
// predict and update allocate nothing after warm-up, and their cost does not depend on how many
// steps went before.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "field_core/belief.hpp"
#include "field_core/occupancy_mask.hpp"
#include "field_core/se2.hpp"
#include "field_core/stamp.hpp"
#include "field_core/state.hpp"

namespace field_core {

/// Motion that odometry reports between two stamps, in the robot's frame at the first.
struct OdometryIncrement {
  Stamp from{0};
  Stamp to{0};
  SE2 delta;
};

/// Value of one field. `variance` is that of the measurement noise; 0: the field's configured
/// noise.
struct Reading {
  int field = 0;
  double value = 0.0;
  double variance = 0.0;
};

/// What the sensors at one place of the robot read at one time. Readings are finite, fields
/// distinct.
struct Sample {
  Stamp stamp{0};
  SE2 sensor_in_base;
  std::vector<Reading> readings;
};

/// Where the robot's base was seen from outside (GPS, a camera in the hall), in the map frame,
/// where predict() left off. `covariance` 0: the configured noise.
struct PositionObservation {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
};

/// What became of a sample, with the filter's own check of it.
struct UpdateResult {
  bool applied = true;
  /// Why it was skipped, or what was odd about one that was applied ("": nothing): one of a few
  /// static texts, counted in diagnostics.
  const char* reason = "";
  double nis = 0.0;  ///< normalized innovation squared of the prediction before the update
  int nis_dof = 0;   ///< its degrees of freedom; 0: no statement

  static UpdateResult skipped(const char* why) { return {false, why, 0.0, 0}; }
};

/// An estimator's own verdict. `reason` is one of a few static texts, "" while it is not lost.
struct Health {
  bool lost = false;
  const char* reason = "";
  /// Effective number of different past paths that its map rests on; 0: no statement.
  double paths_left = 0.0;
};

struct FieldInfo {
  std::string name;
  std::string unit;
};

/// Probabilities of the hyperparameter vectors that one field may have.
struct HyperparameterPosterior {
  std::string field;
  std::vector<std::string> names;  ///< of the hyperparameters
  Eigen::MatrixXd values;          ///< one column per vector, one row per name
  Eigen::VectorXd probability;     ///< sums to 1
};

/// Prediction of a measurement: `variance` is that of the field plus that of the configured noise.
/// One row per field, one column per point.
struct FieldPrediction {
  Eigen::MatrixXd mean;
  Eigen::MatrixXd variance;
  /// Variance before any measurement, one per field: how much of `variance` is still ignorance.
  Eigen::VectorXd prior_variance;
};

/// Axis-aligned rectangle of the map frame. [m]
struct MapRegion {
  double x_min = 0.0, y_min = 0.0, x_max = 0.0, y_max = 0.0;
};

namespace detail {
template <class E, class = void>
struct IsEstimator : std::false_type {};
template <class E>
struct IsEstimator<
    E, std::void_t<typename E::Params, decltype(E::kName),
                   decltype(E(std::declval<const typename E::Params&>(), std::uint64_t{})),
                   decltype(std::declval<E&>().predict(std::declval<const OdometryIncrement&>())),
                   decltype(std::declval<E&>().set_pose(SE2{}, Eigen::Matrix3d{})),
                   decltype(std::declval<E&>().scatter()), decltype(std::declval<E&>().reset()),
                   decltype(std::declval<E&>().restore(std::declval<const State&>()))>>
    : std::bool_constant<
          std::is_same_v<UpdateResult,
                         decltype(std::declval<E&>().update(std::declval<const Sample&>()))> &&
          std::is_same_v<Belief, decltype(std::declval<const E&>().belief())> &&
          std::is_same_v<FieldPrediction, decltype(std::declval<const E&>().predict_field(
                                              std::declval<const Eigen::Matrix2Xd&>()))> &&
          std::is_same_v<const std::vector<FieldInfo>&,
                         decltype(std::declval<const E&>().fields())> &&
          std::is_same_v<MapRegion, decltype(std::declval<const E&>().map_region())> &&
          std::is_same_v<State, decltype(std::declval<const E&>().state())>> {};

template <class E, class = void>
struct HasHealth : std::false_type {};
template <class E>
struct HasHealth<E, std::void_t<decltype(std::declval<const E&>().health())>> : std::true_type {};

template <class E, class = void>
struct HasHyperparameters : std::false_type {};
template <class E>
struct HasHyperparameters<E, std::void_t<decltype(std::declval<const E&>().hyperparameters())>>
    : std::true_type {};

template <class E, class = void>
struct HasPositions : std::false_type {};
template <class E>
struct HasPositions<E, std::void_t<decltype(std::declval<E&>().observe_position(
                           std::declval<const PositionObservation&>()))>> : std::true_type {};

template <class E, class = void>
struct HasObstacles : std::false_type {};
template <class E>
struct HasObstacles<E, std::void_t<decltype(std::declval<E&>().set_obstacles(
                           std::declval<const OccupancyMask&>()))>> : std::true_type {};

template <class E, class = void>
struct HasRobots : std::false_type {};
template <class E>
struct HasRobots<E, std::void_t<decltype(std::declval<const E&>().robots())>> : std::true_type {};

template <class E, class = void>
struct HasRunParameters : std::false_type {};
template <class E>
struct HasRunParameters<E, std::void_t<decltype(E::run_parameters())>> : std::true_type {};
}  // namespace detail

/// The verdict of an estimator that offers one; not lost otherwise.
template <class E>
Health health_of(const E& estimator) {
  if constexpr (detail::HasHealth<E>::value) {
    return estimator.health();
  } else {
    return {};
  }
}

/// The keys an estimator names; none otherwise.
template <class E>
std::vector<std::string> run_parameters_of() {
  if constexpr (detail::HasRunParameters<E>::value) {
    return E::run_parameters();
  } else {
    return {};
  }
}

/// True for a class that meets the requirements above: static_assert it beside each estimator.
template <class E>
inline constexpr bool is_estimator_v = detail::IsEstimator<E>::value;

}  // namespace field_core
