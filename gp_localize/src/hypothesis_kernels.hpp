// The hot loops of gp_localize on plain arrays, compiled for several instruction sets and chosen at
// run time. Callers own all memory; nothing here allocates or throws.
#pragma once

#include "field_core/kernels.hpp"

namespace gp_localize {

/// Whether AVX2 versions are used where the processor has them (the default); returns what is used
/// from now on. For tests and benchmarks.
bool use_wide_vectors(bool wanted);

struct WhitenedSupport {
  field_core::KernelType kernel;
  double signal_variance;
  double length_x, length_y;
  int size;                 // m
  const double* support;    // m pairs
  const double* whitening;  // m x m, row-major, lower triangular
};

/// features (m x n, row-major) = whitening * k(support, points); points: pairs `stride` numbers
/// apart.
void whitened_features(const WhitenedSupport& basis, int n, const double* points, int stride,
                       double* features);

/// Hypotheses are laid side by side, kPanel<T> of them to a panel: one cache line.
template <class T>
constexpr int kPanel = 64 / sizeof(T);

/// One field as C hypotheses (sample paths) know it, hypotheses innermost. A and m as in
/// online_sparse_gp.hpp, of closed slices only; the open slice D' in the form of eq. (12)-(13):
/// Sigma~ is the covariance given the closed slices, F~ F~^T = Sigma~_{D'D'} + noise.
template <class T>
struct HypothesisPanels {
  field_core::KernelType kernel;
  T signal_variance;
  int support;     // m
  int open;        // measurements in the open slice
  int slice_size;  // its capacity
  int hypotheses;  // C
  int panels;      // ceil(C / kPanel)
  T* covariance;   // panels x m(m+1)/2 x kPanel: A, lower triangle by columns
  T* mean;         // panels x m x kPanel: m
  T* open_x;       // panels x slice_size x kPanel: place / length scale; likewise open_y
  T* open_y;
  T* open_gain;    // panels x slice_size x m x kPanel: phi - A phi
  T* open_factor;  // panels x slice_size x slice_size x kPanel: rows of F~, 1 / F~_ii on the
                   // diagonal
  T* open_value;   // panels x slice_size x kPanel: F~^-1 (z - mu~)
  T* weight;       // panels x kPanel: of each hypothesis in the moments; 0 beyond C
};

/// Particles (or any places) to be held against the hypotheses of one field.
template <class T>
struct ParticleBatch {
  int count;          // P
  int stride;         // between rows of features
  const T* features;  // m x P: phi
  const T* residual;  // P: sigma_xx|S + noise of the measurement
  const T* x;         // P: place / length scale; likewise y
  const T* y;
  T value;         // measurement minus prior mean
  T* log_density;  // P x panels x kPanel: log N(value; ...) + log(2 pi) / 2 is ADDED; may be null
  T* moments;      // P x 2: weighted sums over hypotheses of mean and of variance + mean^2, WRITTEN
  T* scratch;      // scratch_size(m) numbers
};

int scratch_size(int support);

/// Densities of eq. (12)-(13) for all pairs; O(P C (m^2 / 2 + open (m + open / 2))).
void add_log_densities(const HypothesisPanels<float>& panels, const ParticleBatch<float>& batch);
void add_log_densities(const HypothesisPanels<double>& panels, const ParticleBatch<double>& batch);

/// Appends to the open slice what hypothesis c measured at its own place. Arrays with hypotheses
/// innermost, padded to panels x kPanel: phi (m rows), x and y (place / length scale).
template <class T>
struct OpenRow {
  const T* features;
  const T* x;
  const T* y;
  T value;
  T noise_variance;
};
void extend_open_slice(HypothesisPanels<float>& panels, const OpenRow<float>& row);
void extend_open_slice(HypothesisPanels<double>& panels, const OpenRow<double>& row);

/// out[p] = log of the mean over the first `hypotheses` numbers of row p of exp(rows), rows
/// `stride` apart.
void log_mean_exp(const float* rows, int count, int hypotheses, int stride, double* out);
void log_mean_exp(const double* rows, int count, int hypotheses, int stride, double* out);

/// y = A x for a symmetric matrix stored as the lower triangle by columns.
void symmetric_multiply(const double* packed, int n, const double* x, double* y);
/// A -= scale g g^T, the same storage.
void symmetric_downdate(double* packed, int n, double scale, const double* g);

}  // namespace gp_localize
