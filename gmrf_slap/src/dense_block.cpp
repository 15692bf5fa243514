#include "dense_block.hpp"

#include <algorithm>

#include "symmetric_kernels.hpp"

namespace gmrf_slap {

void MixtureUpdate::clear(int capacity) {
  size = 0;
  if (static_cast<int>(rows.size()) < capacity) {
    rows.resize(static_cast<std::size_t>(capacity));
    curvature.resize(capacity);
    gain.resize(capacity);
  }
}

void MixtureUpdate::add(const SiteRow& row, double w, double residual, double s) {
  const double g = residual / s;
  rows[static_cast<std::size_t>(size)] = row;
  curvature[size] = w * (1.0 / s - g * g);
  gain[size] = w * g;
  ++size;
}

void DenseBlock::predict(const SiteRow* rows, int count, double* mean, double* variance) const {
  for (int k = 0; k < count; ++k) {
    mean[k] = rows[k].dot(mean_);
    covariances(rows[k], rows + k, 1, variance + k);
  }
}

void DenseBlock::covariances(const SiteRow& a, const SiteRow* b, int count, double* out) const {
  for (int k = 0; k < count; ++k) {
    double sum = 0.0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(a.count); ++i) {
      double row = 0.0;
      for (std::size_t j = 0; j < static_cast<std::size_t>(b[k].count); ++j) {
        row += b[k].weight[j] * at(a.site[i], b[k].site[j]);
      }
      sum += a.weight[i] * row;
    }
    out[k] = sum;
  }
}

/// Rows panel * kPanelRows ... of [C m], C = Sigma A^T and m = C gain.
void DenseBlock::gather_panel(int panel, const MixtureUpdate& update, int columns,
                              double* out) const {
  const int i0 = panel * kPanelRows, rows = std::min(kPanelRows, n_ - i0);
  std::fill(out, out + static_cast<long>(columns) * kPanelRows, 0.0);
  double* m = columns > update.size ? out + static_cast<long>(update.size) * kPanelRows : nullptr;
  for (int k = 0; k < update.size; ++k, out += kPanelRows) {
    const SiteRow& row = update.rows[static_cast<std::size_t>(k)];
    for (std::size_t a = 0; a < static_cast<std::size_t>(row.count); ++a) {
      const int s = row.site[a];
      const double weight = row.weight[a];
      const int above = std::clamp(s - i0, 0, rows);  // rows before the diagonal
      for (int i = 0; i < above; ++i) out[i] += weight * sigma_(s, i0 + i);
      const double* column = sigma_.data() + static_cast<long>(s) * n_ + i0;
      for (int i = above; i < rows; ++i) out[i] += weight * column[i];
    }
    if (m) {
      for (int i = 0; i < rows; ++i) m[i] += update.gain[k] * out[i];
    }
  }
}

void DenseBlock::condition(const MixtureUpdate& update) {
  if (update.size == 0) return;
  // One place: what it contributes beyond 1/s is its own m m^T, and both cancel exactly.
  const bool single = update.size == 1;
  const int columns = single ? 1 : update.size + 1;
  const int panels = panel_count(n_);
  const long panel_size = static_cast<long>(columns) * kPanelRows;
  panels_.resize(std::max(panels_.size(), static_cast<std::size_t>(panels * panel_size)));
  scratch_.resize(std::max(scratch_.size(), downdate_scratch(n_, columns)));
  coefficients_.resize(std::max(coefficients_.size(), static_cast<std::size_t>(columns)));
  for (int k = 0; k < update.size; ++k) {
    coefficients_[static_cast<std::size_t>(k)] = update.curvature[k];
  }
  if (single) {
    coefficients_[0] += update.gain[0] * update.gain[0];
  } else {
    coefficients_[static_cast<std::size_t>(update.size)] = 1.0;
  }
  for (int p = 0; p < panels; ++p) {
    double* out = panels_.data() + p * panel_size;
    gather_panel(p, update, columns, out);
    const int i0 = p * kPanelRows, rows = std::min(kPanelRows, n_ - i0);
    const double* m = out + (single ? 0 : static_cast<long>(update.size) * kPanelRows);
    const double factor = single ? update.gain[0] : 1.0;
    for (int i = 0; i < rows; ++i) mean_[i0 + i] += factor * m[i];
  }
  symmetric_downdate(n_, sigma_.data(), columns, panels_.data(), coefficients_.data(),
                     scratch_.data());
}

}  // namespace gmrf_slap
