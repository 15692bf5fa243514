#include "node_maps.hpp"

#include <algorithm>
#include <cmath>

#include "field_core/errors.hpp"
#include "gp_localize/dense_gp.hpp"
#include "gp_localize/online_sparse_gp.hpp"
#include "gp_localize/resampling.hpp"
#include "path_bank.hpp"

namespace gp_localize {
namespace {

double log_density(double error, double variance) {
  return -0.5 * (error * error / variance + std::log(variance));
}

/// Online PITC along one path.
class SparseMap {
 public:
  SparseMap(const GpLocalizeParams& p, const GraphWorld& world, const Features& features)
      : world_(world),
        features_(features),
        gp_(static_cast<int>(features.rows()),
            p.observation_model == ObservationModelType::fitc ? 1 : p.slice_size,
            p.observation_model == ObservationModelType::online_pitc_assimilated ? Recent::ignored
                                                                                 : Recent::used,
            world.field.basis.dimensions()) {}

  Eigen::Vector2d predict(int node, Evaluation& at) const {
    gp_.evaluate(world_.field.basis, world_.places.col(node), features_.data() + node,
                 features_.cols(), at);
    return {at.mean, at.variance};
  }
  /// `at` is of this node and of this map.
  void learn(int node, const NodeObservation& o, Evaluation& at) {
    gp_.append(world_.places.col(node), features_.data() + node, features_.cols(), at, o.value,
               o.noise_variance);
  }

 private:
  GraphWorld world_;
  const Features& features_;
  OnlineSparseGp gp_;
};

/// Everything, or a subset of data, along one path.
class SubsetMap {
 public:
  SubsetMap(const GpLocalizeParams& p, const GraphWorld& world, const Features&)
      : world_(world), gp_(p.observation_model, p.subset_size) {}

  Eigen::Vector2d predict(int node, Evaluation&) const {
    Eigen::Matrix2Xd moments;
    gp_.predict(world_.field.basis.kernel(), world_.places.col(node), moments);
    return moments.col(0);
  }
  void learn(int node, const NodeObservation& o, Evaluation&) {
    gp_.append(world_.field.basis.kernel(), world_.places.col(node), o.value, o.noise_variance);
  }

 private:
  GraphWorld world_;
  DenseGp gp_;
};

/// One map per particle, of its own path.
template <class Map>
class OwnMaps final : public NodeMaps {
 public:
  OwnMaps(const GpLocalizeParams& params, const GraphWorld& world)
      : motion_(world.motion), evaluations_(params.particles) {
    world.field.basis.features(world.places, features_);
    blank_ = std::make_unique<Map>(params, world, features_);
  }

  void restart(const std::vector<int>& arcs, field_core::Random&) override {
    maps_ = std::vector<Map>(arcs.size(), *blank_);
  }
  void weigh(const std::vector<int>& nodes, const NodeObservation& o,
             std::vector<double>& log_likelihood, Eigen::Matrix2Xd& moments) override {
    for (std::size_t p = 0; p < nodes.size(); ++p) {
      const Eigen::Vector2d m = maps_[p].predict(nodes[p], evaluations_[p]);
      log_likelihood[p] = log_density(o.value - m[0], m[1] + o.likelihood_variance);
      moments.col(static_cast<Eigen::Index>(p)) << m[0], m[1] + m[0] * m[0];
    }
  }
  void learn(const std::vector<int>& arcs, const std::vector<double>&, const NodeObservation& o,
             field_core::Random&) override {
    for (std::size_t p = 0; p < arcs.size(); ++p) {
      maps_[p].learn(motion_.graph().head(arcs[p]), o, evaluations_[p]);
    }
  }
  void resampled(const std::vector<int>& ancestors) override {
    std::vector<Map> children;
    children.reserve(ancestors.size());
    for (const int ancestor : ancestors) children.push_back(maps_[ancestor]);
    maps_.swap(children);
  }

 private:
  const GraphMotion& motion_;
  Features features_;  // m x nodes
  std::unique_ptr<Map> blank_;
  std::vector<Map> maps_;
  std::vector<Evaluation> evaluations_;
};

/// The paper's sample paths, drawn from the motion model and shared by all particles (eq. 9).
class SharedPaths final : public NodeMaps {
 public:
  SharedPaths(const GpLocalizeParams& params, const GraphWorld& world)
      : world_(world),
        slice_size_(params.slice_size),
        redraw_(params.redraw_sample_paths),
        paths_(params.sample_paths),
        bank_(make_path_bank(params, world.field)),
        row_(world.motion.graph().nodes()) {}

  void restart(const std::vector<int>& arcs, field_core::Random& random) override {
    redraw(arcs, std::vector<double>(arcs.size(), 1.0 / static_cast<double>(arcs.size())), random);
    bank_->restart();
    steps_in_slice_ = 0;
  }
  void move(field_core::Random& random) override {
    for (int& arc : paths_) arc = world_.motion.move(arc, random);
  }
  /// Each node that has a particle is weighed once.
  void weigh(const std::vector<int>& nodes, const NodeObservation& o,
             std::vector<double>& log_likelihood, Eigen::Matrix2Xd& moments) override {
    std::fill(row_.begin(), row_.end(), -1);
    distinct_.clear();
    for (const int node : nodes) {
      if (row_[node] >= 0) continue;
      row_[node] = static_cast<int>(distinct_.size());
      distinct_.push_back(node);
    }
    gather(distinct_);
    bank_->begin(static_cast<int>(distinct_.size()));
    bank_->add(points_, o.value, o.likelihood_variance, *bank_, node_moments_);
    bank_->log_mean(node_log_);
    for (std::size_t p = 0; p < nodes.size(); ++p) {
      log_likelihood[p] = node_log_[row_[nodes[p]]];
      auto m = moments.col(static_cast<Eigen::Index>(p));
      m = node_moments_.col(row_[nodes[p]]);
      m[1] -= o.likelihood_variance;
    }
  }
  void learn(const std::vector<int>& arcs, const std::vector<double>& weights,
             const NodeObservation& o, field_core::Random& random) override {
    path_nodes_.clear();
    for (const int arc : paths_) path_nodes_.push_back(world_.motion.graph().head(arc));
    gather(path_nodes_);
    bank_->learn(points_, o.value, o.noise_variance);
    if (++steps_in_slice_ < slice_size_) return;
    steps_in_slice_ = 0;
    bank_->close_slice();
    if (redraw_) redraw(arcs, weights, random);
  }
  void resampled(const std::vector<int>&) override {}

 private:
  void gather(const std::vector<int>& nodes) {
    points_.resize(world_.places.rows(), static_cast<Eigen::Index>(nodes.size()));
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      points_.col(static_cast<Eigen::Index>(i)) = world_.places.col(nodes[i]);
    }
  }
  void redraw(const std::vector<int>& arcs, const std::vector<double>& weights,
              field_core::Random& random) {
    resample_shuffled(weights, paths_.size(), random, drawn_);
    for (std::size_t c = 0; c < paths_.size(); ++c) paths_[c] = arcs[drawn_[c]];
  }

  GraphWorld world_;
  int slice_size_;
  bool redraw_;
  std::vector<int> paths_;  // the arc each was on last
  std::unique_ptr<PathBank> bank_;
  int steps_in_slice_ = 0;
  Places points_;
  Eigen::Matrix2Xd node_moments_;
  std::vector<int> row_, distinct_, path_nodes_, drawn_;
  std::vector<double> node_log_;
};

class KnownMaps final : public NodeMaps {
 public:
  KnownMaps(const Eigen::Matrix2Xd& known, double mean) : known_(known) {
    known_.row(0).array() -= mean;
  }
  void restart(const std::vector<int>&, field_core::Random&) override {}
  void weigh(const std::vector<int>& nodes, const NodeObservation& o,
             std::vector<double>& log_likelihood, Eigen::Matrix2Xd& moments) override {
    for (std::size_t p = 0; p < nodes.size(); ++p) {
      const Eigen::Vector2d m = known_.col(nodes[p]);
      log_likelihood[p] = log_density(o.value - m[0], m[1] + o.likelihood_variance);
      moments.col(static_cast<Eigen::Index>(p)) << m[0], m[1] + m[0] * m[0];
    }
  }
  void learn(const std::vector<int>&, const std::vector<double>&, const NodeObservation&,
             field_core::Random&) override {}
  void resampled(const std::vector<int>&) override {}

 private:
  Eigen::Matrix2Xd known_;
};

}  // namespace

std::unique_ptr<NodeMaps> make_node_maps(const GpLocalizeParams& params, const GraphWorld& world) {
  if (params.map_hypotheses == MapHypotheses::sample_paths) {
    return std::make_unique<SharedPaths>(params, world);
  }
  switch (params.observation_model) {
    case ObservationModelType::offline_pitc:
      throw field_core::ParameterError(
          "observation_model",
          "offline_pitc needs map_hypotheses: sample_paths; online_pitc is the "
          "same model at constant cost");
    case ObservationModelType::full_gp:
    case ObservationModelType::sod_truncate:
    case ObservationModelType::sod_even:
      return std::make_unique<OwnMaps<SubsetMap>>(params, world);
    default:
      return std::make_unique<OwnMaps<SparseMap>>(params, world);
  }
}

std::unique_ptr<NodeMaps> make_known_node_maps(const Eigen::Matrix2Xd& known, double mean) {
  return std::make_unique<KnownMaps>(known, mean);
}

}  // namespace gp_localize
