// GP-Localize on a graph (paper section 4.3): the same particle filter and the same observation
// models as in the plane, where a location is a node and no odometry is known.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "field_core/estimator.hpp"
#include "field_core/random.hpp"
#include "gp_localize/field_model.hpp"
#include "gp_localize/graph_motion.hpp"
#include "gp_localize/params.hpp"

namespace gp_localize {

class NodeMaps;

/// What the filter knows before the run. All must outlive it.
struct GraphWorld {
  const GraphMotion& motion;
  const field_core::Places& places;  ///< of the nodes, d x nodes, as the field's kernel wants them
  const FieldModel& field;
};

/// Of the parameters it uses those of the filter and of the observation model: particles,
/// map_hypotheses, sample_paths, observation_model, slice_size, subset_size, redraw_sample_paths,
/// likelihood_noise_scale, likelihood_exponent, resample_threshold, precision. With map_hypotheses:
/// particle every observation model but offline_pitc may be chosen, also the subsets of data.
class GraphLocalize {
 public:
  /// @throws ParameterError for a combination that is not offered
  GraphLocalize(const GpLocalizeParams& params, const GraphWorld& world, std::uint64_t seed);
  /// On a known map: mean and variance (noise not included) of the field at every node, 2 x nodes.
  /// The field's mean is part of it. Nothing is learned.
  GraphLocalize(const GpLocalizeParams& params, const GraphWorld& world,
                const Eigen::Matrix2Xd& known, std::uint64_t seed);
  ~GraphLocalize();

  /// Forgets everything; the node at the start is drawn from a probability per node.
  void start(const Eigen::VectorXd& probability);
  /// One step of the motion model.
  void predict();
  /// A measurement where the vehicle is now. O(P m^2) with a map per particle, O(P C m^2) with
  /// sample paths. Skips: "no particle explains the measurement".
  field_core::UpdateResult update(double value);

  /// Probability of each node, after the last update.
  const Eigen::VectorXd& belief() const { return belief_; }

 private:
  void resample_if_needed();

  GpLocalizeParams params_;
  GraphWorld world_;
  field_core::Random random_;
  std::unique_ptr<NodeMaps> maps_;
  std::vector<int> arcs_;  // of the particles; they are at its head
  std::vector<double> weights_;
  Eigen::VectorXd belief_;
  std::vector<int> nodes_, ancestors_, children_;
  std::vector<double> log_weights_;
};

/// The exact filter over all arcs, for a known map; with no update, what the motion model alone
/// says.
class GraphForwardFilter {
 public:
  GraphForwardFilter(const GraphMotion& motion, const Eigen::VectorXd& start);
  void predict() { arcs_ = motion_.forward(arcs_); }
  /// @param log_likelihood of each node. @throws NumericalError if no node explains the measurement
  void update(const Eigen::VectorXd& log_likelihood);
  Eigen::VectorXd belief() const { return motion_.nodes(arcs_); }

 private:
  const GraphMotion& motion_;
  Eigen::VectorXd arcs_;
};

}  // namespace gp_localize
