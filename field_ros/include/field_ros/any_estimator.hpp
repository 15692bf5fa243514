// Any estimator E of field_core/estimator.hpp behind one class, so that sessions, nodes and replays
// are compiled once; the only templates of this package are here and in the parameter visitors.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "field_core/estimator.hpp"
#include "field_ros/node_params.hpp"
#include "field_ros/param_doc.hpp"
#include "field_ros/param_loader.hpp"
#include "field_ros/param_values.hpp"

namespace field_ros {

/// The members mean what field_core/estimator.hpp says; `robot` is an index of robots().
class AnyEstimator {
 public:
  virtual ~AnyEstimator() = default;
  virtual const char* name() const = 0;
  /// {""}: one, which the estimator has no name for.
  virtual std::vector<std::string> robots() const = 0;
  virtual bool uses_positions() const = 0;
  virtual bool uses_obstacles() const = 0;
  /// Only if uses_obstacles().
  virtual void set_obstacles(const field_core::OccupancyMask& mask) = 0;
  virtual void predict(const field_core::OdometryIncrement& increment, int robot) = 0;
  virtual field_core::UpdateResult update(const field_core::Sample& sample, int robot) = 0;
  /// Only if uses_positions().
  virtual field_core::UpdateResult observe_position(const field_core::PositionObservation& seen,
                                                    int robot) = 0;
  virtual field_core::Belief belief(int robot) const = 0;
  /// nullopt: the estimator has no verdict of its own.
  virtual std::optional<field_core::Health> health(int robot) const = 0;
  /// Empty: the estimator takes them as known.
  virtual std::vector<field_core::HyperparameterPosterior> hyperparameters() const = 0;
  virtual field_core::FieldPrediction predict_field(const Eigen::Matrix2Xd& points) const = 0;
  virtual const std::vector<field_core::FieldInfo>& fields() const = 0;
  virtual field_core::MapRegion map_region() const = 0;
  virtual void set_pose(const field_core::SE2& pose, const Eigen::Matrix3d& covariance,
                        int robot) = 0;
  virtual void scatter(int robot) = 0;
  virtual void reset() = 0;
  virtual field_core::State state() const = 0;
  virtual void restore(const field_core::State& state) = 0;
};

template <class E>
class EstimatorHolder final : public AnyEstimator {
  static_assert(field_core::is_estimator_v<E>, "E must meet field_core/estimator.hpp");

 public:
  EstimatorHolder(const typename E::Params& params, std::uint64_t seed)
      : estimator_(params, seed) {}
  const char* name() const override { return E::kName; }
  std::vector<std::string> robots() const override {
    if constexpr (kRobots) return estimator_.robots();
    return {""};
  }
  bool uses_positions() const override { return field_core::detail::HasPositions<E>::value; }
  bool uses_obstacles() const override { return field_core::detail::HasObstacles<E>::value; }
  void set_obstacles([[maybe_unused]] const field_core::OccupancyMask& mask) override {
    if constexpr (field_core::detail::HasObstacles<E>::value) estimator_.set_obstacles(mask);
  }
  void predict(const field_core::OdometryIncrement& i, int robot) override {
    call(robot, [&](auto... r) { estimator_.predict(i, r...); });
  }
  field_core::UpdateResult update(const field_core::Sample& s, int robot) override {
    return call(robot, [&](auto... r) { return estimator_.update(s, r...); });
  }
  field_core::UpdateResult observe_position(const field_core::PositionObservation& seen,
                                            int robot) override {
    if constexpr (field_core::detail::HasPositions<E>::value) {
      return call(robot, [&](auto... r) { return estimator_.observe_position(seen, r...); });
    }
    return field_core::UpdateResult::skipped("positions are not used");
  }
  field_core::Belief belief(int robot) const override {
    return call(robot, [&](auto... r) { return estimator_.belief(r...); });
  }
  std::optional<field_core::Health> health([[maybe_unused]] int robot) const override {
    if constexpr (field_core::detail::HasHealth<E>::value) {
      return call(robot, [&](auto... r) { return estimator_.health(r...); });
    }
    return std::nullopt;
  }
  std::vector<field_core::HyperparameterPosterior> hyperparameters() const override {
    if constexpr (field_core::detail::HasHyperparameters<E>::value) {
      return estimator_.hyperparameters();
    }
    return {};
  }
  field_core::FieldPrediction predict_field(const Eigen::Matrix2Xd& points) const override {
    return estimator_.predict_field(points);
  }
  const std::vector<field_core::FieldInfo>& fields() const override { return estimator_.fields(); }
  field_core::MapRegion map_region() const override { return estimator_.map_region(); }
  void set_pose(const field_core::SE2& pose, const Eigen::Matrix3d& covariance,
                int robot) override {
    call(robot, [&](auto... r) { estimator_.set_pose(pose, covariance, r...); });
  }
  void scatter(int robot) override {
    call(robot, [&](auto... r) { estimator_.scatter(r...); });
  }
  void reset() override { estimator_.reset(); }
  field_core::State state() const override { return estimator_.state(); }
  void restore(const field_core::State& state) override { estimator_.restore(state); }

 private:
  static constexpr bool kRobots = field_core::detail::HasRobots<E>::value;

  /// function(robot) of an estimator that knows several, function() otherwise.
  template <class Function>
  static decltype(auto) call([[maybe_unused]] int robot, Function function) {
    if constexpr (kRobots) {
      return function(robot);
    } else {
      return function();
    }
  }

  E estimator_;
};

/// A configured estimator with the parameters of its node.
struct Configured {
  NodeParams node;
  std::unique_ptr<AnyEstimator> estimator;
  std::string configuration;  ///< YAML it was made from
  /// The estimator's parameters by path, as a configuration gives them. @throws DataError
  std::function<ParamValues(const ParamTree&)> values;
  /// Those that may differ from a state's.
  std::vector<std::string> run_parameters;
};

/// Refuses what can only be told from estimator and node together: names of fields that are no
/// topic or file names, a map of too many cells, robots that share topics. @throws ParameterError
void check_configured(const Configured& configured);

/// What the skeletons need to know of an estimator.
struct EstimatorEntry {
  std::string name;
  /// @param seed replaces the parameter `seed`. @throws DataError, NumericalError
  std::function<Configured(const ParamTree&, std::optional<std::uint64_t> seed)> make;
  std::function<std::vector<ParamDoc>()> document;
};

template <class E>
EstimatorEntry estimator_entry() {
  EstimatorEntry entry;
  entry.name = E::kName;
  entry.make = [](const ParamTree& tree, std::optional<std::uint64_t> seed) {
    Configured configured;
    typename E::Params params;
    load_params(tree, configured.node, params);
    configured.configuration = tree.yaml();
    configured.run_parameters = field_core::run_parameters_of<E>();
    configured.values = [](const ParamTree& other) {
      NodeParams node;
      typename E::Params loaded;
      load_params(other, node, loaded);
      return param_values(loaded);
    };
    try {
      configured.estimator = std::make_unique<EstimatorHolder<E>>(
          params, seed.value_or(static_cast<std::uint64_t>(configured.node.seed)));
      check_configured(configured);
    } catch (const field_core::ParameterError& e) {
      rethrow_with_location(tree, e);
    }
    return configured;
  };
  entry.document = [] { return document_params<typename E::Params, NodeParams>(); };
  return entry;
}

}  // namespace field_ros
