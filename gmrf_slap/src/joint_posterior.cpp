#include "joint_posterior.hpp"

#include <cmath>

#include "field_core/errors.hpp"
#include "weights.hpp"

namespace gmrf_slap {

void JointPosterior::compute() {
  const Eigen::Index places = weights.size();
  Eigen::VectorXd log_weights = weights.array().log();
  // log sum_l pi_l N_lk of each field, added to every other field's and to the weights.
  std::vector<Eigen::VectorXd> marginal(fields.size());
  for (std::size_t f = 0; f < fields.size(); ++f) {
    marginal[f].resize(places);
    for (Eigen::Index k = 0; k < places; ++k) {
      LogSum sum;
      for (Eigen::Index l = 0; l < fields[f].probability.size(); ++l) {
        sum.add(std::log(fields[f].probability[l]) + fields[f].log_density(l, k));
      }
      marginal[f][k] = sum.value();
    }
    log_weights += marginal[f];
  }
  const double largest = log_weights.maxCoeff();
  if (!std::isfinite(largest)) {
    throw field_core::NumericalError(
        "no candidate position explains the measurement; raise measurement_stddev or the initial "
        "covariance");
  }
  weights = (log_weights.array() - largest).exp();
  weights /= weights.sum();
  for (std::size_t f = 0; f < fields.size(); ++f) {
    Field& field = fields[f];
    field.share.resize(field.log_density.rows(), places);
    Eigen::VectorXd log_probability(field.probability.size());
    for (Eigen::Index l = 0; l < field.probability.size(); ++l) {
      const Eigen::RowVectorXd logs =
          (log_weights - marginal[f]).transpose() + field.log_density.row(l);
      const double top = logs.maxCoeff();
      field.share.row(l) = (logs.array() - top).exp();
      const double sum = field.share.row(l).sum();
      field.share.row(l) /= sum;
      log_probability[l] = std::log(field.probability[l]) + top + std::log(sum);
    }
    exponentiate_and_normalize(log_probability);
    field.probability = log_probability.cwiseMax(kSmallestProbability);
    field.probability /= field.probability.sum();
  }
}

}  // namespace gmrf_slap
