#include "gp_localize/graph_localize.hpp"

#include <cmath>

#include "field_core/errors.hpp"
#include "gp_localize/resampling.hpp"
#include "node_maps.hpp"

namespace gp_localize {

GraphLocalize::GraphLocalize(const GpLocalizeParams& params, const GraphWorld& world,
                             std::uint64_t seed)
    : params_(params), world_(world), random_(seed), maps_(make_node_maps(params, world)) {
  start(
      Eigen::VectorXd::Constant(world.motion.graph().nodes(), 1.0 / world.motion.graph().nodes()));
}

GraphLocalize::GraphLocalize(const GpLocalizeParams& params, const GraphWorld& world,
                             const Eigen::Matrix2Xd& known, std::uint64_t seed)
    : params_(params),
      world_(world),
      random_(seed),
      maps_(make_known_node_maps(known, world.field.mean)) {
  start(
      Eigen::VectorXd::Constant(world.motion.graph().nodes(), 1.0 / world.motion.graph().nodes()));
}

GraphLocalize::~GraphLocalize() = default;

void GraphLocalize::start(const Eigen::VectorXd& probability) {
  const auto count = static_cast<std::size_t>(params_.particles);
  std::vector<double> cumulative(probability.data(), probability.data() + probability.size());
  low_variance_resample(cumulative, random_.uniform(), count, nodes_);
  arcs_.clear();
  for (const int node : nodes_) arcs_.push_back(world_.motion.arrive(node, random_));
  weights_.assign(count, 1.0 / static_cast<double>(count));
  belief_ = probability;
  maps_->restart(arcs_, random_);
}

void GraphLocalize::predict() {
  maps_->move(random_);
  for (int& arc : arcs_) arc = world_.motion.move(arc, random_);
}

field_core::UpdateResult GraphLocalize::update(double value) {
  const double noise = world_.field.noise_variance;
  const double scale = params_.likelihood_noise_scale * params_.likelihood_noise_scale;
  const NodeObservation observation{value - world_.field.mean, noise, scale * noise};
  for (std::size_t p = 0; p < arcs_.size(); ++p) nodes_[p] = world_.motion.graph().head(arcs_[p]);
  log_weights_.resize(arcs_.size());
  Eigen::Matrix2Xd moments(2, static_cast<Eigen::Index>(arcs_.size()));
  maps_->weigh(nodes_, observation, log_weights_, moments);
  const Eigen::Map<const Eigen::VectorXd> before(weights_.data(), moments.cols());
  const Eigen::Vector2d prediction = moments * before;
  for (std::size_t p = 0; p < arcs_.size(); ++p) {
    log_weights_[p] = params_.likelihood_exponent * log_weights_[p] + std::log(weights_[p]);
  }
  if (!normalize_log_weights(log_weights_)) {
    return field_core::UpdateResult::skipped("no particle explains the measurement");
  }
  field_core::UpdateResult result;
  const double error = observation.value - prediction[0];
  result.nis = error * error /
               (prediction[1] - prediction[0] * prediction[0] + observation.likelihood_variance);
  result.nis_dof = 1;
  weights_ = log_weights_;
  belief_.setZero();
  for (std::size_t p = 0; p < arcs_.size(); ++p) belief_[nodes_[p]] += weights_[p];
  maps_->learn(arcs_, weights_, observation, random_);
  resample_if_needed();
  return result;
}

void GraphLocalize::resample_if_needed() {
  const auto count = static_cast<double>(arcs_.size());
  if (effective_sample_size(weights_) >= params_.resample_threshold * count) return;
  low_variance_resample(weights_, random_.uniform(), arcs_.size(), ancestors_);
  children_.resize(arcs_.size());
  for (std::size_t p = 0; p < arcs_.size(); ++p) children_[p] = arcs_[ancestors_[p]];
  arcs_.swap(children_);
  maps_->resampled(ancestors_);
  weights_.assign(arcs_.size(), 1.0 / count);
}

GraphForwardFilter::GraphForwardFilter(const GraphMotion& motion, const Eigen::VectorXd& start)
    : motion_(motion), arcs_(motion.graph().arcs()) {
  for (int arc = 0; arc < motion.graph().arcs(); ++arc) {
    const int node = motion.graph().head(arc);
    arcs_[arc] = start[node] / static_cast<double>(motion.graph().leaving(node).size());
  }
}

void GraphForwardFilter::update(const Eigen::VectorXd& log_likelihood) {
  const double largest = log_likelihood.maxCoeff();
  for (Eigen::Index arc = 0; arc < arcs_.size(); ++arc) {
    const int node = motion_.graph().head(static_cast<int>(arc));
    arcs_[arc] *= std::exp(log_likelihood[node] - largest);
  }
  const double total = arcs_.sum();
  if (!(total > 0.0)) {
    throw field_core::NumericalError(
        "no node explains the measurement; raise the noise of the likelihood");
  }
  arcs_ /= total;
}

}  // namespace gp_localize
