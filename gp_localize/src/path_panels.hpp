// The maps of all sample paths of one field, laid out so that weighing particles is one matrix
// product: phi^T A phi = svec(phi phi^T) . svec(A) over packed symmetric matrices.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "gp_localize/field_model.hpp"
#include "gp_localize/online_sparse_gp.hpp"

namespace gp_localize {

/// A field of a group as measured at some place.
struct Reading {
  int member;
  double value;
  double noise_variance;
};

/// Interface that hides the precision. Paths must close their slices together.
class PathPanels {
 public:
  virtual ~PathPanels() = default;
  /// Takes over the maps of paths whose slices have just been closed: per path, one column of A
  /// (lower triangle by columns) followed by m, as in OnlineSparseGp.
  virtual void assimilate(const Eigen::MatrixXd& summaries) = 0;
  /// Path c measured `value` at places.col(c), all of one field, whose features are
  /// features.col(c); with Recent::ignored this changes nothing until the slice is closed.
  virtual void extend(const SupportBasis& basis, const Places& places, const Features& features,
                      double value, double noise_variance) = 0;
  /// Weights of the paths in the moments, summing to 1; all equal unless said.
  virtual void weight(const std::vector<double>& weights) = 0;
  /// Makes room for and clears the sums of log densities of `particles` particles.
  virtual void begin(int particles) = 0;
  /// Adds this field's log density of `value` for all particles x paths to the sums of `total`.
  /// @param moments 2 x P: per particle, weighted mean and mean square of the paths'
  ///                predictions
  virtual void add(const SupportBasis& basis, const Places& places, double value,
                   double noise_variance, PathPanels* total, Eigen::Matrix2Xd& moments) = 0;
  /// Likewise of several fields of a group, each once, measured together at places (d x P, without
  /// the field's number): their joint density. moments[k] is of reading k given those before it.
  /// Never interpolated. For q readings O(q^2) times the cost of one.
  virtual void add_joint(const SupportBasis& basis, const Places& places,
                         const std::vector<Reading>& readings, PathPanels* total,
                         std::vector<Eigen::Matrix2Xd>& moments) = 0;
  /// Per particle, log of the mean over paths of the densities summed up since begin().
  virtual void log_mean(std::vector<double>& log_likelihood) const = 0;
};

/// Appends the open slices that maps have in common in number, oldest row first.
void extend_by_open_rows(const SupportBasis& basis, const std::vector<const OnlineSparseGp*>& maps,
                         PathPanels& panels);

/// @param slice_size steps; the open slice has room for as many measurements of each field
/// @param interpolation_tolerance 0: every pair is evaluated. Otherwise particles that stand close
///        together share evaluations (interpolation_box.hpp), where the kernel is smooth and it
///        pays; means are then off by at most this share of the noise's standard deviation,
///        variances by this share of its variance
std::unique_ptr<PathPanels> make_path_panels(const SupportBasis& basis, int paths, int slice_size,
                                             Recent recent, Precision precision,
                                             double interpolation_tolerance = 0.0);

}  // namespace gp_localize
