// The dense engine: one block of all sites.
#include "dense_block.hpp"
#include "field_core/cholmod.hpp"
#include "gmrf_slap/gaussian_field.hpp"

namespace gmrf_slap {
namespace {

Eigen::MatrixXd inverse(const Eigen::SparseMatrix<double>& precision) {
  field_core::SparseCholesky factor;
  const Eigen::SparseMatrix<double> lower = precision.triangularView<Eigen::Lower>();
  factor.factorize(lower);
  return factor.solve(Eigen::MatrixXd::Identity(precision.rows(), precision.cols()));
}

class DenseField final : public GaussianField {
 public:
  explicit DenseField(const Eigen::SparseMatrix<double>& precision)
      : block_(Eigen::VectorXd::Zero(precision.rows()), inverse(precision)) {}

  int sites() const override { return block_.size(); }
  void predict(const SiteRow* rows, int count, double* mean, double* variance) const override {
    block_.predict(rows, count, mean, variance);
  }
  void covariances(const SiteRow& a, const SiteRow* b, int count, double* out) const override {
    block_.covariances(a, b, count, out);
  }
  void condition(const MixtureUpdate& update) override { block_.condition(update); }
  Eigen::VectorXd mean() const override { return block_.mean(); }
  Eigen::VectorXd variances() const override { return block_.sigma().diagonal(); }
  Eigen::VectorXd multiply(const Eigen::VectorXd& x) const override {
    return block_.sigma().selfadjointView<Eigen::Lower>() * x;
  }
  void survey(const SiteRow* rows, int count, double* mean, double* variance) const override {
    block_.predict(rows, count, mean, variance);
  }

  std::unique_ptr<GaussianField> clone() const override {
    return std::make_unique<DenseField>(*this);
  }
  std::size_t memory_bytes() const override { return block_.memory_bytes(); }
  void save(field_core::State& state, const std::string& prefix) const override {
    state.set(prefix + "mean", block_.mean());
    state.set(prefix + "covariance", block_.sigma());
  }
  void restore(const field_core::State& state, const std::string& prefix) override {
    const Eigen::VectorXd mean = state.matrix(prefix + "mean", sites(), 1);
    block_ = DenseBlock(mean, state.matrix(prefix + "covariance", sites(), sites()));
  }

 private:
  DenseBlock block_;
};

}  // namespace

std::unique_ptr<GaussianField> make_dense_field(const Eigen::SparseMatrix<double>& precision) {
  return std::make_unique<DenseField>(precision);
}

std::size_t dense_field_bytes(int sites) {
  return 8 * static_cast<std::size_t>(sites) * static_cast<std::size_t>(sites);
}

}  // namespace gmrf_slap
