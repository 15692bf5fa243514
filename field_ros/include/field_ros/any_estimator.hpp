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

/// The members mean what field_core/estimator.hpp says.
class AnyEstimator {
 public:
  virtual ~AnyEstimator() = default;
  virtual const char* name() const = 0;
  virtual void predict(const field_core::OdometryIncrement& increment) = 0;
  virtual field_core::UpdateResult update(const field_core::Sample& sample) = 0;
  virtual field_core::Belief belief() const = 0;
  /// nullopt: the estimator has no verdict of its own.
  virtual std::optional<field_core::Health> health() const = 0;
  /// Empty: the estimator takes them as known.
  virtual std::vector<field_core::HyperparameterPosterior> hyperparameters() const = 0;
  virtual field_core::FieldPrediction predict_field(const Eigen::Matrix2Xd& points) const = 0;
  virtual const std::vector<field_core::FieldInfo>& fields() const = 0;
  virtual field_core::MapRegion map_region() const = 0;
  virtual void set_pose(const field_core::SE2& pose, const Eigen::Matrix3d& covariance) = 0;
  virtual void scatter() = 0;
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
  void predict(const field_core::OdometryIncrement& i) override { estimator_.predict(i); }
  field_core::UpdateResult update(const field_core::Sample& s) override {
    return estimator_.update(s);
  }
  field_core::Belief belief() const override { return estimator_.belief(); }
  std::optional<field_core::Health> health() const override {
    if constexpr (field_core::detail::HasHealth<E>::value) return estimator_.health();
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
  void set_pose(const field_core::SE2& pose, const Eigen::Matrix3d& covariance) override {
    estimator_.set_pose(pose, covariance);
  }
  void scatter() override { estimator_.scatter(); }
  void reset() override { estimator_.reset(); }
  field_core::State state() const override { return estimator_.state(); }
  void restore(const field_core::State& state) override { estimator_.restore(state); }

 private:
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
/// topic or file names, a map of too many cells. @throws ParameterError
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
