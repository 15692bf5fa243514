#include "vector_field_slam/batch_solver.hpp"

#include <chrono>

#include "field_core/errors.hpp"
#include "solver_common.hpp"

namespace vector_field_slam {

using field_core::SE2;

namespace {

template <int M>
BatchProblem<M> optimized(const Model<M>& model, BatchProblem<M> problem) {
  BatchOptimizer<M> optimizer(model);
  optimizer.optimize(problem);
  return problem;
}

}  // namespace

template <int M>
BatchSolver<M>::BatchSolver(const Model<M>& model, const EseifOptions& online,
                            const BackgroundOptions& options)
    : model_(model), options_(options), online_(model, online), log_(model) {}

template <int M>
void BatchSolver<M>::start(const StartState& state) {
  finish();
  online_.start(state);
  log_.start(state);
  stamps_.assign(1, stamp_);
  logging_ = true;
  samples_ = 0;
}

template <int M>
void BatchSolver<M>::move(const OdometryStep<double>& step, double calibration_variance) {
  if (logging_) log_.move(online_.robot().template head<kPose>(), step);
  online_.move(step, calibration_variance);
}

template <int M>
void BatchSolver<M>::set_pose(const SE2& pose, const Eigen::Matrix3d& covariance) {
  online_.set_pose(pose, covariance);
  finish();  // what runs knows nothing of it
  if (logging_) log_.set_pose(pose, covariance);
}

template <int M>
void BatchSolver<M>::start_channel(int channel, double value) {
  online_.start_channel(channel, value);
  finish();
  if (!logging_) return;
  for (auto& node : log_.problem().nodes) node[channel] = value;
  for (auto& prior : log_.problem().priors) prior.mean[channel] = value;
}

template <int M>
field_core::UpdateResult BatchSolver<M>::observe(const Mounting<double>& mounting,
                                                 const Observation<double>* observations,
                                                 int count) {
  const auto result = online_.observe(mounting, observations, count);
  if (!result.applied || !logging_) return result;
  log_.observe(mounting, observations, count, online_);
  stamps_.push_back(stamp_);
  ++samples_;
  const bool room = static_cast<int>(log_.problem().poses.size()) <= options_.most_poses;
  if (!running_ && room && samples_ % options_.period == 0) begin();
  if (running_ && samples_ >= job_.due) {
    const bool ready = job_.result.wait_for(std::chrono::seconds(0)) != std::future_status::timeout;
    if (ready || wait_ || options_.delay == 0) {
      running_ = false;
      correct(job_.result.get());
    } else if (samples_ == job_.due) {
      ++late_;
    }
  }
  return result;
}

template <int M>
std::vector<Eigen::Matrix<double, M, 1>> BatchSolver<M>::node_means() const {
  std::vector<Eigen::Matrix<double, M, 1>> means;
  means.reserve(static_cast<std::size_t>(node_count()));
  for (int i = 0; i < node_count(); ++i) {
    means.emplace_back(Eigen::Map<const Eigen::Matrix<double, M, 1>>(node_values(i)));
  }
  return means;
}

template <int M>
void BatchSolver<M>::begin() {
  job_.robot = online_.robot();
  job_.nodes = log_.problem().nodes = node_means();
  job_.due = samples_ + options_.delay;
  job_.result = std::async(options_.delay > 0 ? std::launch::async : std::launch::deferred,
                           optimized<M>, model_, log_.problem());
  running_ = true;
}

/// Leaves a running optimization unused.
template <int M>
void BatchSolver<M>::finish() {
  if (running_) job_.result.wait();
  running_ = false;
}

template <int M>
void BatchSolver<M>::correct(const BatchProblem<M>& result) {
  const std::size_t poses = result.poses.size(), known = result.nodes.size();
  const SE2 then(Eigen::Vector3d(job_.robot.template head<kPose>()));
  const SE2 motion = SE2(result.poses.back()) * then.inverse();
  auto& problem = log_.problem();
  const SE2 logged = SE2(result.poses.back()) * SE2(problem.poses[poses - 1]).inverse();
  std::copy(result.poses.begin(), result.poses.end(), problem.poses.begin());
  for (std::size_t t = poses; t < problem.poses.size(); ++t) {
    problem.poses[t] = (logged * SE2(problem.poses[t])).vector();
  }
  problem.offset = result.offset;

  auto nodes = node_means();
  for (std::size_t i = 0; i < known; ++i) nodes[i] += result.nodes[i] - job_.nodes[i];
  for (const auto& link : problem.node_links) {  // those since then follow their near node
    if (link.node < static_cast<int>(known) || link.node >= static_cast<int>(nodes.size())) {
      continue;
    }
    nodes[link.node] +=
        nodes[link.near] - Eigen::Map<const Eigen::Matrix<double, M, 1>>(node_values(link.near));
  }
  RobotVector robot = online_.robot();
  const Eigen::Vector2d offset = robot.tail<2>() + result.offset - job_.robot.template tail<2>();
  robot << (motion * SE2(Eigen::Vector3d(robot.head<kPose>()))).vector(), offset;
  online_.set_mean(robot, nodes);
  ++corrections_;
}

template <int M>
void BatchSolver<M>::save(field_core::State& state) const {
  online_.save(state);
  if (!logging_) return;
  const auto all = optimized<M>(model_, log_.problem());
  Eigen::MatrixXd trajectory(4, all.poses.size());
  for (std::size_t t = 0; t < all.poses.size(); ++t) {
    trajectory.col(static_cast<Eigen::Index>(t)) << static_cast<double>(stamps_[t].count()),
        all.poses[t];
  }
  state.set("trajectory", trajectory);
}

template <int M>
void BatchSolver<M>::restore(const field_core::State& state) {
  finish();
  online_.restore(state);
  logging_ = false;
}

template class BatchSolver<1>;
template class BatchSolver<2>;
template class BatchSolver<3>;
template class BatchSolver<4>;
template class BatchSolver<5>;
template class BatchSolver<6>;
template class BatchSolver<7>;
template class BatchSolver<8>;

}  // namespace vector_field_slam
