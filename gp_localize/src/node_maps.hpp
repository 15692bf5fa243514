// The field at the nodes of a graph as the hypotheses of the past path know it.
#pragma once

#include <memory>
#include <vector>

#include "gp_localize/graph_localize.hpp"

namespace gp_localize {

/// One measurement, as the filter passes it on.
struct NodeObservation {
  double value;  ///< minus the field's mean
  double noise_variance, likelihood_variance;
};

class NodeMaps {
 public:
  virtual ~NodeMaps() = default;
  /// Forgets everything; hypotheses start as the particles do.
  virtual void restart(const std::vector<int>& arcs, field_core::Random& random) = 0;
  virtual void move(field_core::Random&) {}
  /// Log density of the observation for each particle at its node; and the moments of its
  /// prediction over the particles, without noise.
  virtual void weigh(const std::vector<int>& nodes, const NodeObservation& observation,
                     std::vector<double>& log_likelihood, Eigen::Matrix2Xd& moments) = 0;
  /// Adds the observation just weighed. `weights` are the new ones, of the particles on `arcs`.
  virtual void learn(const std::vector<int>& arcs, const std::vector<double>& weights,
                     const NodeObservation& observation, field_core::Random& random) = 0;
  virtual void resampled(const std::vector<int>& ancestors) = 0;
};

/// @throws ParameterError for a combination that is not offered
std::unique_ptr<NodeMaps> make_node_maps(const GpLocalizeParams& params, const GraphWorld& world);
std::unique_ptr<NodeMaps> make_known_node_maps(const Eigen::Matrix2Xd& known, double mean);

}  // namespace gp_localize
