// The dense engine: the lower triangle of Sigma, column-major.
#include <algorithm>

#include "field_core/cholmod.hpp"
#include "gmrf_slap/gaussian_field.hpp"
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

namespace {

class DenseField final : public GaussianField {
 public:
  explicit DenseField(const Eigen::SparseMatrix<double>& precision)
      : n_(static_cast<int>(precision.rows())), mean_(Eigen::VectorXd::Zero(n_)) {
    field_core::SparseCholesky factor;
    const Eigen::SparseMatrix<double> lower = precision.triangularView<Eigen::Lower>();
    factor.factorize(lower);
    sigma_ = factor.solve(Eigen::MatrixXd::Identity(n_, n_));
  }

  int sites() const override { return n_; }
  const Eigen::VectorXd& mean() const override { return mean_; }
  Eigen::VectorXd variances() const override { return sigma_.diagonal(); }
  std::unique_ptr<GaussianField> clone() const override {
    return std::make_unique<DenseField>(*this);
  }
  std::size_t memory_bytes() const override {
    return 8 * (static_cast<std::size_t>(sigma_.size()) + panels_.size() + scratch_.size());
  }

  void predict(const SiteRow* rows, int count, double* mean, double* variance) const override {
    for (int k = 0; k < count; ++k) {
      const SiteRow& row = rows[k];
      mean[k] = 0.0;
      for (std::size_t a = 0; a < static_cast<std::size_t>(row.count); ++a) {
        mean[k] += row.weight[a] * mean_[row.site[a]];
      }
      covariances(row, &row, 1, variance + k);
    }
  }

  void covariances(const SiteRow& a, const SiteRow* b, int count, double* out) const override {
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

  void condition(const MixtureUpdate& update) override;

  void save(field_core::State& state, const std::string& prefix) const override {
    state.set(prefix + "mean", mean_);
    state.set(prefix + "covariance", sigma_);
  }
  void restore(const field_core::State& state, const std::string& prefix) override {
    const Eigen::MatrixXd& mean = state.matrix(prefix + "mean", n_, 1);
    sigma_ = state.matrix(prefix + "covariance", n_, n_);
    mean_ = mean;
  }

 private:
  double at(int i, int j) const { return sigma_(std::max(i, j), std::min(i, j)); }
  void gather_panel(int panel, const MixtureUpdate& update, int columns, double* out) const;

  int n_;
  Eigen::VectorXd mean_;
  Eigen::MatrixXd sigma_;  // only the lower triangle is kept up to date
  // Kept between steps so that a step allocates nothing.
  std::vector<double> panels_, scratch_, coefficients_;
};

/// Rows panel * kPanelRows ... of [C m], C = Sigma A^T and m = C gain.
void DenseField::gather_panel(int panel, const MixtureUpdate& update, int columns,
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

void DenseField::condition(const MixtureUpdate& update) {
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

}  // namespace

std::unique_ptr<GaussianField> make_dense_field(const Eigen::SparseMatrix<double>& precision) {
  return std::make_unique<DenseField>(precision);
}

std::size_t dense_field_bytes(int sites) {
  return 8 * static_cast<std::size_t>(sites) * static_cast<std::size_t>(sites);
}

}  // namespace gmrf_slap
