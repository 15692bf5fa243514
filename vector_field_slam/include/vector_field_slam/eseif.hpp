// Vector Field SLAM by an exactly sparse extended information filter: the paper's Algorithm 1 in
// fixed memory, for a microcontroller or a host. No heap, no exceptions, no libraries; S is float
// or double, Map a FixedMap or anything alike.
//
// In place of eta (eq. 15) the filter keeps the residual eta - Lambda mu. Then the measurement
// update (16) reads residual += H^T Q^-1 (z - h(mu)), the motion update (21)-(22) leaves a residual
// of zero at zero, and absolute positions never enter a sum: what makes single precision work.
// Recovering the local mean (39) sets the local residuals to zero; those of the other nodes wait.
#pragma once

#include "vector_field_slam/eseif_config.hpp"
#include "vector_field_slam/eseif_nodes.hpp"
#include "vector_field_slam/eseif_window.hpp"
#include "vector_field_slam/underweighting.hpp"

namespace vector_field_slam {

template <class S, int M, class Map, int MaxRings>
class Eseif {
 public:
  using Config = EseifConfig<S, M>;
  using State = EseifState<S, M, Map>;
  using Report = EseifReport<S>;
  static constexpr int kNodes = State::kNodes;
  static constexpr int kLocal = State::kLocal;

  explicit Eseif(const Config& config) : config_(config) {}

  /// Eq. (43) with finite priors, in a cell whose nodes start at `values`. Forgets everything.
  /// @param covariance kRobot x kRobot, positive definite @return false if it is not
  bool start(const S* robot, const S* covariance, GridIndex cell, const S (*values)[M]) {
    state_.map.clear();
    state_.cell = cell;
    for (int j = 0; j < 4; ++j) {
      state_.active[j] = state_.map.add(cell_node(cell, j));
      auto& node = state_.map.node(state_.active[j]);
      for (int i = 0; i < M; ++i) {
        node.mean[i] = values[j][i];
        node.information[packed(M, i, i)] = S(1) / config_.prior_variance[i];
      }
    }
    connect_cell();
    for (int i = 0; i < kRobot; ++i) state_.robot[i] = robot[i];
    for (auto& row : state_.cross) {
      for (S& x : row) x = S(0);
    }
    return set_robot_covariance(covariance) && window_.condense(state_, config_.rings);
  }

  /// The robot's variables are set from outside, independent of the map from now on.
  bool set_robot(const S* robot, const S* covariance) {
    if (!detach()) return false;
    for (int i = 0; i < kRobot; ++i) state_.robot[i] = robot[i];
    for (auto& row : state_.cross) {
      for (S& x : row) x = S(0);
    }
    return set_robot_covariance(covariance);
  }

  /// Motion, eq. (20)-(29), with x = {pose, c}: c moves by noise only; 0 leaves it part of the map,
  /// as in Algorithm 1 (the result is the same). O((4 M)^2) @return false: not positive definite
  bool move(const OdometryStep<S>& step, S calibration_variance);

  /// Measurement, Algorithm 1: enters the sensor's cell if it is another one, then eq. (16)-(18)
  /// and (39). Readings of distinct channels. O(M^3), at a cell change O((ring M)^3).
  Report observe(const Mounting<S>& mounting, const Observation<S>* readings, int count);

  const State& state() const { return state_; }
  /// For restoring a saved one; the window follows by resume().
  State& state() { return state_; }
  /// Rebuilds what is cached from the state and the drift it had.
  bool resume(const S* covariance);
  const Config& config() const { return config_; }
  /// Covariance of the robot's variables, kRobot x kRobot.
  const S* robot_covariance() const { return covariance_; }

 private:
  /// Information over the local variables of the cell that is entered (upper triangle, in their
  /// order), as far as it is kept.
  struct Joint {
    S a[kLocal * kLocal];
    bool is_new[4];  ///< nodes that come with it, as the robot does
    bool given[4];   ///< nodes of the map that it depends on
  };

  /// The readings of one measurement that are used, linearized.
  struct Linearized {
    S h_nodes[M][kNodes], h_robot[M][kRobot];
    S v[M][kLocal];  ///< rows of H, whitened by the factor
    S innovation[M], variance[M];
    int used;
  };

  bool set_robot_covariance(const S* covariance);
  bool detach();
  bool window_joint(GridIndex cell, const NewNode* added, int count, Joint& joint);
  bool shared_joint(GridIndex cell, Joint& joint);
  bool blank_joint(Joint& joint);
  bool condition(Joint& joint);
  void attach(const Joint& joint);
  EseifOutcome enter(GridIndex cell, const S* unknown_values, Report& report);
  void add_node(const NewNode& node, const S* unknown_values);
  bool add_independent(const NewNode& node);
  bool fits_window(GridIndex cell, const NewNode* added, int count) const;
  bool recover();
  void connect_cell();
  void local_information(S* a, const int* row_of);
  void update(const Mounting<S>& mounting, const Observation<S>* readings, int count,
              Report& report);
  void linearize(const Mounting<S>& mounting, const Observation<S>* readings, int count,
                 Linearized& rows) const;
  S curvature_variance(const Curvature<S, M>& curvature) const;
  bool correct(const Linearized& rows, Report& report);
  void add_information(const Linearized& rows);
  void apply(const S* step);
  bool updated_covariance(const S* factor, const S (*v)[kLocal], const S* variances, int count);

  Config config_;
  State state_;
  EseifWindow<S, M, Map, MaxRings> window_;
  S covariance_[kRobot * kRobot] = {};
  S matrix_[kLocal * kLocal];  // of the local system; scratch
};

}  // namespace vector_field_slam

#include "vector_field_slam/eseif_cells.hpp"
#include "vector_field_slam/eseif_relocation.hpp"
#include "vector_field_slam/eseif_steps.hpp"
