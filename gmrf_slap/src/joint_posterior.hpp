// Eq. (12)-(14): position and hyperparameters together, for one or several fields measured at once.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace gmrf_slap {

/// Places k with prior weights p_k (sum 1), fields f with hypotheses l of probability pi_fl, and
/// the densities N_flk of the measurements there:
///   w_k    ~ p_k prod_f sum_l pi_fl N_flk
///   pi_fl' ~ pi_fl sum_k N_flk p_k prod_{f' != f} sum_l' pi_f'l' N_f'l'k.
/// The fields' hyperparameters are independent given the place; that they depend on it beyond the
/// current measurement is dropped (remark 2.3).
struct JointPosterior {
  struct Field {
    Eigen::MatrixXd log_density;  ///< in: hypotheses x places
    Eigen::VectorXd probability;  ///< in: pi_f, out: pi_f'
    Eigen::MatrixXd share;        ///< out: weight of place k given theta_l, rows sum to 1
  };
  std::vector<Field> fields;
  Eigen::VectorXd weights;  ///< in: p, out: w

  /// O(fields x hypotheses x places). @throws NumericalError if no place explains the measurement
  void compute();
};

}  // namespace gmrf_slap
