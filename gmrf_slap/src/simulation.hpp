// The simulation of the paper's section III: a field drawn from the prior on a torus, robots that
// drive on its sites, know their commands, and observe their positions badly. Used by tests and by
// gmrf_slap_simulation.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "gmrf_slap/params.hpp"

namespace gmrf_slap {

struct SimulationSettings {
  int side = 31;  ///< sites along each axis, 1 m apart, centred at the origin
  int steps = 100;
  int robots = 1;
  Theta truth{50.0, 0.1, 2};
  double measurement_stddev = 0.1;  ///< sigma_epsilon
  double position_stddev = 10.0;    ///< sigma_e [m]
  double command_length = 2.0;      ///< |F u| [m]; the heading wanders
  double process_stddev = 0.3;      ///< of v in eq. (18) along each axis [m]
  bool known_start = false;         ///< otherwise anywhere on the grid
  bool wrap = true;                 ///< a torus, as in the paper
  int score_every = 1;              ///< steps between looks at the whole field; the last is one
  Eigen::VectorXd field;            ///< values of the sites; empty: drawn from the prior
};

/// Case 1: exact positions. Case 2: observed positions taken as exact. Case 3: the estimator.
enum class Knowledge { exact, naive, slap };

struct SimulationResult {
  double squared_error = 0.0;        ///< of the field's mean, over all sites and steps
  double final_squared_error = 0.0;  ///< the same after the last step
  double position_error = 0.0;       ///< mean distance over the last tenth of the run [m]
  double field_coverage = 0.0;       ///< share of sites inside the 90 % interval at the end
  double position_coverage = 0.0;    ///< share of steps with the truth inside the 90 % ellipse
  double true_theta = 0.0;           ///< posterior probability of the true hyperparameters
  double left_out = 0.0;             ///< mean posterior mass left out per step
  double step_seconds = 0.0;         ///< mean time of one robot's step
};

/// What a run looked like, for pictures.
struct SimulationRecord {
  Eigen::Matrix2Xd sites;
  Eigen::VectorXd truth, mean, variance;  ///< of the field at the end
  struct Visit {
    int step = 0, robot = 0;
    Eigen::Vector2d truth, observed, estimate;
    Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  };
  std::vector<Visit> visits;
};

/// The paper's Theta: {(k, a), (0.1 k, a), (10 k, a), (k, 0.1 a), (k, 10 a)}, uniform.
std::vector<HyperparameterParams> paper_hyperparameters(const Theta& theta);

/// The estimator's parameters that belong to a simulation; what `base` says of beliefs is kept.
GmrfSlapParams simulation_params(const SimulationSettings& settings, GmrfSlapParams base = {});

/// The same seed: the same field, drive, observations and measurements in every case.
SimulationResult simulate(const SimulationSettings& settings, const GmrfSlapParams& params,
                          Knowledge knowledge, std::uint64_t seed,
                          SimulationRecord* record = nullptr);

}  // namespace gmrf_slap
