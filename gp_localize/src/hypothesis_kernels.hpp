// The hot loops over particles x hypotheses on plain arrays, compiled for several instruction sets.
// Callers own all memory; nothing here allocates or throws.
#pragma once

#include "field_core/kernels.hpp"
#include "instruction_sets.hpp"

namespace gp_localize {

/// Hypotheses are laid side by side, kPanel<T> of them to a panel: one cache line.
template <class T>
constexpr int kPanel = 64 / sizeof(T);

/// One field as C hypotheses (sample paths) know it, hypotheses innermost. A and m as in
/// online_sparse_gp.hpp, of closed slices only; the open slice D' in the form of eq. (12)-(13):
/// Sigma~ is the covariance given the closed slices, F~ F~^T = Sigma~_{D'D'} + noise.
template <class T>
struct HypothesisPanels {
  field_core::KernelType kernel;
  const T* prior;  // slice_size: of each open measurement's field with the field at hand, the
                   // covariance at one place; alone, the variance
  int dimensions;  // d
  int support;     // m
  int open;        // measurements in the open slice
  int slice_size;  // its capacity
  int hypotheses;  // C
  int panels;      // ceil(C / kPanel)
  T* covariance;   // panels x m(m+1)/2 x kPanel: A, lower triangle by columns
  T* mean;         // panels x m x kPanel: m
  T* open_place;   // panels x slice_size x d x kPanel: place / length scale
  T* open_gain;    // panels x slice_size x m x kPanel: phi - A phi
  T* open_factor;  // panels x slice_size x slice_size x kPanel: rows of F~, 1 / F~_ii on the
                   // diagonal
  T* open_value;   // panels x slice_size x kPanel: F~^-1 (z - mu~)
  T* weight;       // panels x kPanel: of each hypothesis in the moments; 0 beyond C
};

/// Places to be held against the hypotheses of one field.
template <class T>
struct PlaceBatch {
  int count;          // P
  int stride;         // between rows of features
  const T* features;  // m x P: phi
  const T* residual;  // P: sigma_xx|S, with the noise of the measurement if it is to be weighed
  const T* place;     // d x P: place / length scale
  T* scratch;         // scratch_size(m) numbers
};

/// What a measurement makes of the predictions at P particles.
template <class T>
struct Scores {
  T value;         // measurement minus prior mean
  T* log_density;  // P x panels x kPanel: log N(value; ...) + log(2 pi) / 2 is ADDED; may be null
  T* moments;      // P x 2: weighted sums over hypotheses of mean and of variance + mean^2, WRITTEN
};

/// Predictions of eq. (12)-(13) of the hypotheses at a few nodes, and how the prediction at each of
/// P particles follows from them: sum over nodes of coefficient times prediction.
template <class T>
struct NodePredictions {
  int nodes;              // r
  T* mean;                // panels x r x kPanel; likewise variance
  T* variance;            // without the noise of the measurement
  int count;              // P
  const T* coefficients;  // r x P
  T noise_variance;
  T* scratch;  // scratch_size of interpolation: r numbers for each of kBatch particles
};

/// Particles that are prepared at a time, at most.
constexpr int kBatch = 60;
/// Numbers of scratch that a batch of places needs.
constexpr int scratch_size(int support) { return kBatch * (support * (support + 1) / 2 + support); }

/// Densities of eq. (12)-(13) for all pairs; O(P C (m^2 / 2 + open (m + open / 2))).
void add_log_densities(const HypothesisPanels<float>& panels, const PlaceBatch<float>& places,
                       const Scores<float>& scores);
void add_log_densities(const HypothesisPanels<double>& panels, const PlaceBatch<double>& places,
                       const Scores<double>& scores);

/// Predictions at `nodes.nodes` places; the same cost per pair.
void predict_nodes(const HypothesisPanels<float>& panels, const PlaceBatch<float>& places,
                   const NodePredictions<float>& nodes);
void predict_nodes(const HypothesisPanels<double>& panels, const PlaceBatch<double>& places,
                   const NodePredictions<double>& nodes);
/// Densities for all pairs from the predictions at the nodes; O(P C r).
void add_interpolated_log_densities(const HypothesisPanels<float>& panels,
                                    const NodePredictions<float>& nodes,
                                    const Scores<float>& scores);
void add_interpolated_log_densities(const HypothesisPanels<double>& panels,
                                    const NodePredictions<double>& nodes,
                                    const Scores<double>& scores);

/// Appends to the open slice what hypothesis c measured at its own place. Arrays with hypotheses
/// innermost, padded to panels x kPanel: phi (m rows), place / length scale (d
/// rows).
template <class T>
struct OpenRow {
  const T* features;
  const T* place;
  T value;
  T noise_variance;
};
void extend_open_slice(HypothesisPanels<float>& panels, const OpenRow<float>& row);
void extend_open_slice(HypothesisPanels<double>& panels, const OpenRow<double>& row);

}  // namespace gp_localize
