#include "dense_block.hpp"

#include <algorithm>

#include "symmetric_kernels.hpp"

namespace gmrf_slap {

void MixtureUpdate::clear(int capacity) {
  size = groups = 0;
  if (static_cast<int>(rows.size()) < capacity) {
    rows.resize(static_cast<std::size_t>(capacity));
    first.resize(static_cast<std::size_t>(capacity) + 1);
    curvature.resize(capacity);
    gain.resize(capacity);
  }
}

void MixtureUpdate::add(const SiteRow& row, double w, double residual, double s, bool joined) {
  const double g = residual / s;
  if (!joined || groups == 0) first[static_cast<std::size_t>(groups++)] = size;
  rows[static_cast<std::size_t>(size)] = row;
  curvature[size] = w * (1.0 / s - g * g);
  gain[size] = w * g;
  first[static_cast<std::size_t>(groups)] = ++size;
}

void DenseBlock::predict(const SiteRow* rows, int count, double* mean, double* variance) const {
  for (int k = 0; k < count; ++k) {
    mean[k] = rows[k].dot(mean_);
    covariances(rows[k], rows + k, 1, variance + k);
  }
}

void DenseBlock::covariances(const SiteRow& a, const SiteRow* b, int count, double* out) const {
  if (a.count == 1) {  // nearest site: no need for the loops below
    const int i = a.site[0];
    const double weight = a.weight[0];
    for (int k = 0; k < count; ++k) {
      if (b[k].count == 1) {
        out[k] = weight * b[k].weight[0] * at(i, b[k].site[0]);
      } else {
        out[k] = weight * column_dot(i, b[k]);
      }
    }
    return;
  }
  for (int k = 0; k < count; ++k) {
    double sum = 0.0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(a.count); ++i) {
      sum += a.weight[i] * column_dot(a.site[i], b[k]);
    }
    out[k] = sum;
  }
}

/// Rows i0 ... i0 + kPanelRows - 1 of a column of Sigma, 0 beyond the last: a part of the lower
/// triangle as it is, or put together in the buffer.
const double* DenseBlock::sigma_rows(int i0, int column, double* buffer) const {
  const double* lower = sigma_.data() + static_cast<long>(column) * n_ + i0;
  const int rows = std::min(kPanelRows, n_ - i0);
  if (column <= i0 && rows == kPanelRows) return lower;
  const int above = std::clamp(column - i0, 0, rows);  // rows before the diagonal
  const double* across = sigma_.data() + static_cast<long>(i0) * n_ + column;
  for (int i = 0; i < above; ++i) buffer[i] = across[static_cast<long>(i) * n_];
  std::copy(lower + above, lower + rows, buffer + above);
  std::fill(buffer + rows, buffer + kPanelRows, 0.0);
  return buffer;
}

/// Rows panel * kPanelRows ... of [C m], C = Sigma A^T with a column per group, m = Sigma A^T gain.
void DenseBlock::gather_panel(int panel, const MixtureUpdate& update, double* out,
                              double* m) const {
  const int i0 = panel * kPanelRows;
  std::fill(out, out + static_cast<long>(update.groups) * kPanelRows, 0.0);
  std::fill(m, m + kPanelRows, 0.0);
  double buffer[kPanelRows] = {};
  for (int g = 0; g < update.groups; ++g, out += kPanelRows) {
    const auto* first = update.first.data() + g;
    for (int k = first[0]; k < first[1]; ++k) {
      const SiteRow& row = update.rows[static_cast<std::size_t>(k)];
      for (std::size_t a = 0; a < static_cast<std::size_t>(row.count); ++a) {
        const double* sigma = sigma_rows(i0, row.site[a], buffer);
        const double share = shares_[static_cast<std::size_t>(k)] * row.weight[a];
        const double gain = update.gain[k] * row.weight[a];
        for (int i = 0; i < kPanelRows; ++i) out[i] += share * sigma[i];
        for (int i = 0; i < kPanelRows; ++i) m[i] += gain * sigma[i];
      }
    }
  }
}

/// Of each group's curvature, and of each place in its group.
void DenseBlock::take_shares(const MixtureUpdate& update) {
  shares_.resize(std::max(shares_.size(), static_cast<std::size_t>(update.size)));
  coefficients_.resize(std::max(coefficients_.size(), static_cast<std::size_t>(update.groups) + 1));
  for (int g = 0; g < update.groups; ++g) {
    const int begin = update.first[static_cast<std::size_t>(g)],
              end = update.first[static_cast<std::size_t>(g) + 1];
    const double sum = update.curvature.segment(begin, end - begin).sum();
    coefficients_[static_cast<std::size_t>(g)] = sum;
    for (int k = begin; k < end; ++k) {
      shares_[static_cast<std::size_t>(k)] =
          end - begin == 1 ? 1.0 : (sum == 0.0 ? 0.0 : update.curvature[k] / sum);
    }
  }
  coefficients_[static_cast<std::size_t>(update.groups)] = 1.0;
}

void DenseBlock::condition(const MixtureUpdate& update) {
  if (update.size == 0) return;
  // One place: what it contributes beyond 1/s is its own m m^T, and both cancel exactly.
  const bool single = update.size == 1;
  const int columns = update.groups + (single ? 0 : 1);
  const int panels = panel_count(n_);
  const long panel_size = static_cast<long>(columns) * kPanelRows;
  panels_.resize(std::max(panels_.size(), static_cast<std::size_t>(panels * panel_size)));
  scratch_.resize(std::max(scratch_.size(), downdate_scratch(n_, columns)));
  take_shares(update);
  if (single) coefficients_[0] += update.gain[0] * update.gain[0];
  double alone[kPanelRows];
  for (int p = 0; p < panels; ++p) {
    double* out = panels_.data() + p * panel_size;
    double* m = single ? alone : out + static_cast<long>(update.groups) * kPanelRows;
    gather_panel(p, update, out, m);
    const int i0 = p * kPanelRows, rows = std::min(kPanelRows, n_ - i0);
    for (int i = 0; i < rows; ++i) mean_[i0 + i] += m[i];
  }
  symmetric_downdate(n_, sigma_.data(), columns, panels_.data(), coefficients_.data(),
                     scratch_.data());
}

}  // namespace gmrf_slap
