// All fields of a run, each under every hyperparameter vector that it may have: what the robots
// share.
#pragma once

#include <memory>
#include <vector>

#include "field_core/estimator.hpp"
#include "gmrf_slap/gaussian_field.hpp"
#include "gmrf_slap/lattice.hpp"
#include "gmrf_slap/params.hpp"

namespace gmrf_slap {

/// One field. z | theta_l ~ given[l], plus the prior mean; theta ~ probability.
struct FieldMixture {
  field_core::FieldInfo info;
  double mean = 0.0;                                ///< prior mean at the map's origin
  Eigen::Vector2d trend = Eigen::Vector2d::Zero();  ///< its slope [field unit/m]
  double noise_variance = 0.0, nugget_variance = 0.0;
  std::vector<Theta> thetas;
  Eigen::VectorXd prior;               ///< of theta, sums to 1
  std::vector<double> prior_variance;  ///< of a site, per theta
  std::vector<std::unique_ptr<GaussianField>> given;
  Eigen::VectorXd probability;  ///< pi(theta_l | D), eq. (14), sums to 1

  int hypotheses() const { return static_cast<int>(thetas.size()); }
  double prior_mean(const Eigen::Vector2d& point) const { return mean + trend.dot(point); }
  /// Mean over theta at all sites, a deviation from the prior mean.
  Eigen::VectorXd site_mean() const;
};

/// A reading ready for the filter: finite, its noise (with the nugget) above 0.
struct Observation {
  int field = 0;
  double value = 0.0;  ///< [field unit]
  double noise = 0.0;  ///< variance
};

class FieldBank {
 public:
  /// @throws ParameterError: a grid too large for memory_limit (with the size it would need),
  /// hyperparameters that make a precision matrix singular, an impossible lattice
  explicit FieldBank(const GmrfSlapParams& params, const Walls& walls = {});
  FieldBank(const FieldBank& other) { *this = other; }
  FieldBank& operator=(const FieldBank& other);
  FieldBank(FieldBank&&) = default;
  FieldBank& operator=(FieldBank&&) = default;

  const Lattice& lattice() const { return lattice_; }
  std::vector<FieldMixture>& fields() { return fields_; }
  const std::vector<FieldMixture>& fields() const { return fields_; }

  const Walls& walls() const { return *walls_; }

  /// H at a place, of sites on its side of the walls; outside of the grid count = 0: nothing is
  /// known there.
  SiteRow row(const Eigen::Vector2d& point) const;

  /// Tells every field which sites one robot's next step names (GaussianField::focus).
  void focus(const std::vector<int>& sites, const std::vector<int>& ahead);
  bool needs_focus() const { return engine_ != Engine::dense; }

  /// Counts the changes of any field: whoever keeps what follows from the fields looks here.
  std::size_t version() const { return version_; }
  void changed() { ++version_; }

  /// Brings in a measurement taken at a known place, exactly: eq. (17), and theta by its evidence.
  void assimilate(const Observation& z, const Eigen::Vector2d& place);

  /// Mixture over theta (eq. 13): mean and variance of a measurement, nugget and noise included.
  field_core::FieldPrediction predict(const Eigen::Matrix2Xd& points) const;

  void save(field_core::State& state) const;
  void restore(const field_core::State& state);
  void reset();  ///< back to the prior

 private:
  Lattice lattice_{Eigen::Vector2d::Zero(), 1.0, 1, 1, false};
  Interpolation interpolation_ = Interpolation::bilinear;
  std::shared_ptr<const Walls> walls_;
  Engine engine_ = Engine::dense;
  std::vector<FieldMixture> fields_;
  std::vector<std::vector<std::shared_ptr<const GaussianField>>> priors_;
  std::size_t version_ = 0;
};

}  // namespace gmrf_slap
