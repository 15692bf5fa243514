// WindowField as blocks of numbers.
#include "field_core/errors.hpp"
#include "window_field.hpp"

namespace gmrf_slap {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Sparse = Eigen::SparseMatrix<double>;

namespace {
Eigen::Index index_of(std::size_t k) { return static_cast<Eigen::Index>(k); }
}  // namespace

void WindowField::save(field_core::State& state, const std::string& prefix) const {
  MatrixXd entries(3, index_of(precision_.entries()));
  Eigen::Index k = 0;
  for (int s = 0; s < sites(); ++s) {
    for (const SparseRows::Entry& e : precision_.row(s)) entries.col(k++) << s, e.column, e.value;
  }
  state.set(prefix + "precision", entries);
  state.set(prefix + "information", information_);
  state.set(prefix + "last_mean", last_mean_);
  const auto as_matrix = [](const std::vector<int>& sites) {
    MatrixXd out(index_of(sites.size()), 1);
    for (std::size_t i = 0; i < sites.size(); ++i) out(index_of(i), 0) = sites[i];
    return out;
  };
  state.set(prefix + "window", as_matrix(window_.sites()));
  state.set(prefix + "focused", static_cast<double>(focused_.size()));
  for (std::size_t f = 0; f < focused_.size(); ++f) {
    state.set(prefix + "focus" + std::to_string(f), as_matrix(focused_[f].sites));
    state.set(prefix + "ahead" + std::to_string(f), as_matrix(focused_[f].ahead));
  }
  state.set(prefix + "window_mean", block_.mean());
  state.set(prefix + "window_covariance", block_.sigma());
}

void WindowField::restore(const field_core::State& state, const std::string& prefix) {
  // Earlier versions kept what a window had learned apart from the precision matrix.
  if (state.numbers().count(prefix + "pairs")) {
    throw field_core::DataError(
        "the state of an earlier version of the sparse and local engines "
        "cannot be continued; map anew");
  }
  const auto as_sites = [&](const std::string& name) {
    std::vector<int> out;
    const MatrixXd& m = state.matrix(prefix + name);
    for (Eigen::Index i = 0; i < m.size(); ++i) {
      out.push_back(static_cast<int>(m(i)));
      if (out.back() < 0 || out.back() >= sites()) {
        throw field_core::DataError("block '" + prefix + name + "' names a site outside the grid");
      }
    }
    return out;
  };
  WindowField next(lattice_, Sparse(sites(), sites()), settings_);
  const MatrixXd& entries = state.matrix(prefix + "precision", 3, -1);
  for (Eigen::Index k = 0; k < entries.cols(); ++k) {
    const int i = static_cast<int>(entries(0, k)), j = static_cast<int>(entries(1, k));
    if (i < 0 || j < 0 || i >= sites() || j >= sites()) {
      throw field_core::DataError("block '" + prefix + "precision' leaves the grid");
    }
    next.precision_.add(i, j, entries(2, k));
  }
  next.precision_.compact();
  next.information_ = state.matrix(prefix + "information", sites(), 1);
  next.last_mean_ = state.matrix(prefix + "last_mean", sites(), 1);
  for (const int s : as_sites("window")) next.window_.insert(s);
  const Eigen::Index n = next.window_.size();
  for (int f = 0; f < static_cast<int>(state.scalar(prefix + "focused")); ++f) {
    next.focused_.push_back(
        {as_sites("focus" + std::to_string(f)), as_sites("ahead" + std::to_string(f))});
  }
  if (n > 0) {
    const VectorXd mean = state.matrix(prefix + "window_mean", n, 1);
    next.block_ = DenseBlock(mean, state.matrix(prefix + "window_covariance", n, n));
  }
  *this = std::move(next);
}

}  // namespace gmrf_slap
