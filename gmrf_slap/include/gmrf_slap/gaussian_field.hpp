// What is known of one field for one hyperparameter vector: z ~ N(mean, Sigma) on the sites of a
// lattice, whatever the engine keeps instead of Sigma.
//
// A measurement z~ whose place is uncertain (places k with weights w_k, rows a_k) makes a mixture
// of Gaussians; eq. (15)-(17) keep its first two moments. With s_k = a_k Sigma a_k^T + noise, g_k =
// (z~ - a_k mean) / s_k, C = Sigma A^T and m = C (w o g) they are
//
//   mean'  = mean + m
//   Sigma' = Sigma - C diag(w_k (1/s_k - g_k^2)) C^T - m m^T,
//
// one symmetric product, the same numbers as component by component.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "field_core/state.hpp"
#include "gmrf_slap/lattice.hpp"

namespace gmrf_slap {

/// Places of one measurement with what each contributes; `size` of the arrays are in use.
///
/// Places in a row may be joined to a group, all their curvatures of one sign: what they add up to,
/// sum_k d_k c_k c_k^T, then enters Sigma' as D c c^T, D = sum_k d_k, c = sum_k d_k c_k / D. mean'
/// and m are as without groups.
struct MixtureUpdate {
  int size = 0;
  int groups = 0;
  std::vector<SiteRow> rows;
  Eigen::VectorXd curvature;  ///< w (1/s - g^2) [1/field unit^2]
  Eigen::VectorXd gain;       ///< w g [1/field unit]
  std::vector<int> first;     ///< place of each group, and `size` at the end

  void clear(int capacity);
  /// Appends a place of weight w whose predicted measurement has variance s; to the last group or
  /// to one of its own.
  void add(const SiteRow& row, double w, double residual, double s, bool joined = false);
};

/// Values are deviations from the field's prior mean. [field unit]
class GaussianField {
 public:
  virtual ~GaussianField() = default;

  virtual int sites() const = 0;

  /// The sites that the next calls of predict, covariances and condition name. The engines whose
  /// cost does not grow with the grid have to be told; each call stands for one robot. `ahead`:
  /// where the robot is, so that the next calls may name sites around it. Returns whether
  /// covariances may differ from before in the last bits (sparse) or by the approximation (local).
  virtual bool focus(const std::vector<int>& /*sites*/, const std::vector<int>& /*ahead*/) {
    return false;
  }
  /// Mean and variance of rows.
  virtual void predict(const SiteRow* rows, int count, double* mean, double* variance) const = 0;
  /// out[i] = a Sigma b_i^T.
  virtual void covariances(const SiteRow& a, const SiteRow* b, int count, double* out) const = 0;
  /// Mean' and Sigma' as above.
  virtual void condition(const MixtureUpdate& update) = 0;

  // For maps: all sites at once, whatever is in focus.
  virtual Eigen::VectorXd mean() const = 0;
  virtual Eigen::VectorXd variances() const = 0;
  /// Sigma x.
  virtual Eigen::VectorXd multiply(const Eigen::VectorXd& x) const = 0;
  /// As predict, for rows anywhere.
  virtual void survey(const SiteRow* rows, int count, double* mean, double* variance) const = 0;

  virtual std::unique_ptr<GaussianField> clone() const = 0;
  virtual std::size_t memory_bytes() const = 0;
  /// All that distinguishes this belief from the prior, as blocks named `prefix`...
  virtual void save(field_core::State& state, const std::string& prefix) const = 0;
  /// @throws DataError and changes nothing if the blocks do not fit
  virtual void restore(const field_core::State& state, const std::string& prefix) = 0;
};

/// Sigma as a dense matrix. predict O(1) per row, condition O(n^2 K / 2), memory 8 n^2 bytes.
/// @throws NumericalError if the precision is not positive definite
std::unique_ptr<GaussianField> make_dense_field(const Eigen::SparseMatrix<double>& precision);

/// Bytes of one dense field, for a refusal before anything is allocated.
std::size_t dense_field_bytes(int sites);

/// The same for one windowed field before any measurement, its window aside.
std::size_t window_field_bytes(int sites);

/// How a field keeps a dense window around what the robots need, above a sparse precision matrix.
///
/// A measurement changes Q only in the block of its candidate sites, Q' = Q + E N E^T, so that as
/// long as all candidates are inside a window W the marginal of W changes as the dense engine
/// changes it, exactly and without looking at the rest, and Q by (Sigma'_UU)^-1 - (Sigma_UU)^-1 on
/// the sites U that were measured. When the robots leave the window a new one is taken from Q by
/// eliminating everything else.
struct WindowSettings {
  int margin = 4;  ///< the window reaches this many sites beyond those ahead
  /// Eliminated around what was asked for, beyond the margin; what is further away is held at its
  /// last mean. Negative: everything, which is exact.
  int halo = -1;
  int grow_up_to = 0;         ///< on grids of at most this many sites windows only grow
  int memory = 1;             ///< calls of focus() that the window serves: robots
  int largest_window = 4000;  ///< [sites]
};

/// halo < 0: the sparse engine, equal to the dense one. Otherwise the local engine: no step depends
/// on the size of the grid. condition O(W^2 K / 2).
/// @param precision both triangles
std::unique_ptr<GaussianField> make_window_field(const Lattice& lattice,
                                                 const Eigen::SparseMatrix<double>& precision,
                                                 const WindowSettings& settings);

}  // namespace gmrf_slap
