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
struct MixtureUpdate {
  int size = 0;
  std::vector<SiteRow> rows;
  Eigen::VectorXd curvature;  ///< w (1/s - g^2) [1/field unit^2]
  Eigen::VectorXd gain;       ///< w g [1/field unit]

  void clear(int capacity);
  /// Appends a place of weight w whose predicted measurement has mean mu and variance s.
  void add(const SiteRow& row, double w, double residual, double s);
};

/// Values are deviations from the field's prior mean. [field unit]
class GaussianField {
 public:
  virtual ~GaussianField() = default;

  virtual int sites() const = 0;
  virtual const Eigen::VectorXd& mean() const = 0;
  /// Mean and variance of the first `count` rows.
  virtual void predict(const SiteRow* rows, int count, double* mean, double* variance) const = 0;
  /// out[i] = a Sigma b_i^T.
  virtual void covariances(const SiteRow& a, const SiteRow* b, int count, double* out) const = 0;
  /// Mean' and Sigma' as above. @throws NumericalError if Sigma' is not positive definite (engines
  /// that factorize notice)
  virtual void condition(const MixtureUpdate& update) = 0;
  /// Variance of every site.
  virtual Eigen::VectorXd variances() const = 0;

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

}  // namespace gmrf_slap
