// The information filter online, corrected by least squares over the whole run: periodically in the
// background (solver: eseif with background_period), or at once (solver: batch).
#pragma once

#include <future>

#include "vector_field_slam/batch_log.hpp"
#include "vector_field_slam/batch_optimizer.hpp"
#include "vector_field_slam/eseif_solver.hpp"

namespace vector_field_slam {

struct BackgroundOptions {
  int period = 100;  ///< samples between optimizations, > 0
  int delay = 20;    ///< samples after which a result is used, 0 .. period; 0: at once
  int most_poses = 4000;
};

/// Every `period` samples a copy of the run is optimized by a worker thread; `delay` samples later
/// the online filter takes over what it says: nodes and offset are shifted by the difference
/// between the result and the filter of then, and the robot moves with its pose of then. The
/// filter's information stays as it is.
///
/// When a result is due and not ready, a filter that waits stays where it is until it is, so that
/// the estimates depend on the samples only, whatever the machine; one that does not goes on and
/// takes the result at the first sample at which it is ready (counted by late()). Replays wait; the
/// live node does not, and equals the replay while late() is 0.
///
/// A step costs the filter's, plus once per period a copy of the run and once a pass over the map.
/// Runs longer than `most_poses` are corrected no more: the optimization would take ever longer.
template <int M>
class BatchSolver final : public Solver {
 public:
  BatchSolver(const Model<M>& model, const EseifOptions& online, const BackgroundOptions& options);

  void start(const StartState& state) override;
  void move(const OdometryStep<double>& step, double calibration_variance) override;
  void stamp(field_core::Stamp stamp) override { stamp_ = stamp; }
  field_core::UpdateResult observe(const Mounting<double>& mounting,
                                   const Observation<double>* observations, int count) override;
  void set_pose(const field_core::SE2& pose, const Eigen::Matrix3d& covariance) override;

  void start_channel(int channel, double value) override;

  RobotVector robot() const override { return online_.robot(); }
  RobotMatrix robot_covariance() const override { return online_.robot_covariance(); }
  int node_count() const override { return online_.node_count(); }
  GridIndex node_index(int node) const override { return online_.node_index(node); }
  int find(GridIndex index) const override { return online_.find(index); }
  const double* node_values(int node) const override { return online_.node_values(node); }
  Eigen::MatrixXd node_covariance(const std::vector<int>& nodes) const override {
    return online_.node_covariance(nodes);
  }

  /// The online filter, the log, and an optimization that is under way (its result is waited for):
  /// what follows a restore is the same. For those who read it, block "trajectory" holds all poses
  /// of the run as the batch sees them after one more optimization, columns (stamp [ns], x, y,
  /// yaw).
  void save(field_core::State& state) const override;
  void restore(const field_core::State& state) override;

  void wait_for_background(bool wait) override { wait_ = wait; }
  int late() const { return late_; }
  int corrections() const { return corrections_; }

 private:
  struct Job {
    RobotVector robot;  ///< of the online filter when it began
    std::vector<Eigen::Matrix<double, M, 1>> nodes;
    std::shared_future<BatchProblem<M>> result;
    int due = 0;
  };

  void begin();
  void finish();
  void correct(const BatchProblem<M>& result);
  void save_job(field_core::State& state) const;
  Job load_job(const field_core::State& state, const BatchProblem<M>& problem) const;
  std::vector<Eigen::Matrix<double, M, 1>> node_means() const;

  Model<M> model_;
  BackgroundOptions options_;
  EseifSolver<M> online_;
  BatchLog<M> log_;
  std::vector<field_core::Stamp> stamps_;  // of the log's poses
  field_core::Stamp stamp_{0};
  bool wait_ = false, logging_ = false, running_ = false;
  int samples_ = 0, late_ = 0, corrections_ = 0;
  Job job_;
};

}  // namespace vector_field_slam
