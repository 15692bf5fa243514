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
  auto result = online_.observe(mounting, observations, count);
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
      result.reason = kLate;
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
                           optimized<M>, model_, log_.problem())
                    .share();
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
  state.set("log", logging_ ? 1.0 : 0.0);
  if (!logging_) return;
  log_.save(state);
  state.set("batch_counts", Eigen::Vector4d(samples_, late_, corrections_, running_ ? 1.0 : 0.0));
  if (running_) save_job(state);
  const auto all = optimized<M>(model_, log_.problem());
  Eigen::MatrixXd trajectory(4, all.poses.size());
  for (std::size_t t = 0; t < all.poses.size(); ++t) {
    trajectory.col(static_cast<Eigen::Index>(t)) << static_cast<double>(stamps_[t].count()),
        all.poses[t];
  }
  state.set("trajectory", trajectory);
}

template <int M>
void BatchSolver<M>::save_job(field_core::State& state) const {
  const BatchProblem<M>& result = job_.result.get();
  Eigen::MatrixXd poses(3, result.poses.size()), nodes(2 * M, result.nodes.size());
  for (std::size_t t = 0; t < result.poses.size(); ++t) {
    poses.col(static_cast<Eigen::Index>(t)) = result.poses[t];
  }
  for (std::size_t i = 0; i < result.nodes.size(); ++i) {
    nodes.col(static_cast<Eigen::Index>(i)) << job_.nodes[i], result.nodes[i];
  }
  state.set("job_poses", poses);
  state.set("job_nodes", nodes);
  state.set("job_offset", result.offset);
  state.set("job_robot", job_.robot);
  state.set("job_due", job_.due);
}

template <int M>
typename BatchSolver<M>::Job BatchSolver<M>::load_job(const field_core::State& state,
                                                      const BatchProblem<M>& problem) const {
  const Eigen::MatrixXd &poses = state.matrix("job_poses", 3, -1),
                        &nodes = state.matrix("job_nodes", 2 * M, -1);
  if (poses.cols() < 1 || poses.cols() > static_cast<Eigen::Index>(problem.poses.size()) ||
      nodes.cols() > static_cast<Eigen::Index>(problem.nodes.size())) {
    throw field_core::DataError("state block 'job_poses' is not of this log; the file is damaged");
  }
  Job job;
  BatchProblem<M> result;
  for (const auto& pose : poses.colwise()) result.poses.emplace_back(pose);
  for (const auto& node : nodes.colwise()) {
    job.nodes.emplace_back(node.template head<M>());
    result.nodes.emplace_back(node.template tail<M>());
  }
  result.offset = state.matrix("job_offset", 2, 1);
  job.robot = state.matrix("job_robot", kRobot, 1);
  job.due = static_cast<int>(state.scalar("job_due"));
  std::promise<BatchProblem<M>> known;
  known.set_value(std::move(result));
  job.result = known.get_future().share();
  return job;
}

template <int M>
void BatchSolver<M>::restore(const field_core::State& state) {
  BatchLog<M> log(model_);
  std::vector<field_core::Stamp> stamps;
  Eigen::Vector4d counts = Eigen::Vector4d::Zero();
  Job job;
  const bool logging = state.scalar("log") != 0.0;
  if (logging) {
    log.restore(state);
    counts = state.matrix("batch_counts", 4, 1);
    if (counts[3] != 0.0) job = load_job(state, log.problem());
    const auto poses = static_cast<Eigen::Index>(log.problem().poses.size());
    const Eigen::MatrixXd& trajectory = state.matrix("trajectory", 4, poses);
    for (Eigen::Index t = 0; t < poses; ++t) {
      stamps.emplace_back(static_cast<std::int64_t>(trajectory(0, t)));
    }
  }
  online_.restore(state);  // the last that can fail
  finish();
  log_ = std::move(log);
  stamps_ = std::move(stamps);
  job_ = std::move(job);
  logging_ = logging;
  samples_ = static_cast<int>(counts[0]);
  late_ = static_cast<int>(counts[1]);
  corrections_ = static_cast<int>(counts[2]);
  running_ = counts[3] != 0.0;
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
