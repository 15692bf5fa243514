#include "field_core/cholmod.hpp"

#include <cholmod.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "corner_inverse.hpp"
#include "field_core/errors.hpp"
#include "selected_inverse.hpp"
#include "supernodal.hpp"

namespace field_core {
namespace {

// A view of Eigen's storage as CHOLMOD's lower triangular symmetric matrix; nothing is copied and
// CHOLMOD does not write to it.
cholmod_sparse view_of(const Eigen::SparseMatrix<double>& m) {
  cholmod_sparse view{};
  view.nrow = view.ncol = static_cast<std::size_t>(m.rows());
  view.nzmax = static_cast<std::size_t>(m.nonZeros());
  view.p = const_cast<int*>(m.outerIndexPtr());
  view.i = const_cast<int*>(m.innerIndexPtr());
  view.x = const_cast<double*>(m.valuePtr());
  view.stype = -1;
  view.itype = CHOLMOD_INT;
  view.xtype = CHOLMOD_REAL;
  view.dtype = CHOLMOD_DOUBLE;
  view.sorted = view.packed = 1;
  return view;
}

FactorColumns columns_of(const cholmod_factor& factor) {
  return {static_cast<int>(factor.n), static_cast<const int*>(factor.p),
          static_cast<const int*>(factor.i), static_cast<const double*>(factor.x)};
}

void check_input(const Eigen::SparseMatrix<double>& m) {
  if (m.rows() != m.cols() || m.rows() == 0) {
    throw NumericalError("a Cholesky factor needs a square matrix with at least one row, not " +
                         std::to_string(m.rows()) + " x " + std::to_string(m.cols()));
  }
  if (!m.isCompressed()) {
    throw NumericalError("the sparse matrix is not compressed; call makeCompressed() first");
  }
  for (Eigen::Index j = 0; j < m.outerSize(); ++j) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(m, j); it; ++it) {
      if (!std::isfinite(it.value())) {
        throw NumericalError("the matrix holds a number that is not finite in column " +
                             std::to_string(j) + "; check the measurements and their noise");
      }
    }
  }
}

}  // namespace

struct SparseCholesky::Impl {
  explicit Impl(Elimination elimination) : supernodal(elimination == Elimination::supernodal) {
    cholmod_start(&common);
    common.print = 0;
    common.nmethods = 1;
    common.method[0].ordering = CHOLMOD_AMD;
    common.postorder = 1;
    // Simplicial: no BLAS, whose threads could change the last bits. LL^T, because CHOLMOD's LDL^T
    // accepts negative pivots. Supernodes are only analysed by CHOLMOD.
    common.supernodal = supernodal ? CHOLMOD_SUPERNODAL : CHOLMOD_SIMPLICIAL;
    common.final_ll = 1;
  }
  ~Impl() {
    cholmod_free_dense(&solution, &common);
    cholmod_free_dense(&workspace_y, &common);
    cholmod_free_dense(&workspace_e, &common);
    cholmod_free_factor(&factor, &common);
    cholmod_free_factor(&pattern, &common);
    cholmod_finish(&common);
  }

  bool same_pattern(const Eigen::SparseMatrix<double>& m) const {
    const int* outer = m.outerIndexPtr();
    const int* inner = m.innerIndexPtr();
    return (supernodal ? pattern : factor) &&
           this->outer.size() == static_cast<std::size_t>(m.cols()) + 1 &&
           std::equal(this->outer.begin(), this->outer.end(), outer) &&
           std::equal(this->inner.begin(), this->inner.end(), inner);
  }

  /// Order of elimination with the variables of `block` last.
  std::vector<int> constrained_order(cholmod_sparse& view) {
    std::vector<int> member(view.nrow, 0), order(view.nrow);
    for (const int k : block) member[static_cast<std::size_t>(k)] = 1;
    if (!cholmod_camd(&view, nullptr, 0, member.data(), order.data(), &common)) order.clear();
    return order;
  }

  void analyse(cholmod_sparse& view, const Eigen::SparseMatrix<double>& m) {
    cholmod_free_factor(&factor, &common);
    cholmod_free_factor(&pattern, &common);
    common.method[0].ordering = block.empty() ? CHOLMOD_AMD : CHOLMOD_GIVEN;
    common.postorder = block.empty();  // it could move the block
    if (block.empty()) {
      factor = cholmod_analyze(&view, &common);
    } else {
      std::vector<int> order = constrained_order(view);
      if (!order.empty()) factor = cholmod_analyze_p(&view, order.data(), nullptr, 0, &common);
    }
    if (!factor) throw NumericalError("CHOLMOD could not order the matrix: not enough memory");
    if (supernodal) std::swap(factor, pattern);
    outer.assign(m.outerIndexPtr(), m.outerIndexPtr() + m.cols() + 1);
    inner.assign(m.innerIndexPtr(), m.innerIndexPtr() + m.nonZeros());
    ++analyses;
  }

  /// Lower triangle in the order of elimination.
  void permute(const Eigen::SparseMatrix<double>& m) {
    const auto* order = static_cast<const int*>(pattern->Perm);
    const auto n = static_cast<std::size_t>(m.cols());
    std::vector<int> place(n);
    for (std::size_t k = 0; k < n; ++k) {
      place[static_cast<std::size_t>(order[k])] = static_cast<int>(k);
    }
    start.assign(n + 1, 0);
    rows.resize(static_cast<std::size_t>(m.nonZeros()));
    values.resize(rows.size());
    const auto each = [&](const auto& visit) {
      for (int j = 0; j < m.outerSize(); ++j) {
        const int b = place[static_cast<std::size_t>(j)];
        for (Eigen::SparseMatrix<double>::InnerIterator it(m, j); it; ++it) {
          const int a = place[static_cast<std::size_t>(it.row())];
          visit(std::max(a, b), static_cast<std::size_t>(std::min(a, b)), it.value());
        }
      }
    };
    each([&](int, std::size_t column, double) { ++start[column + 1]; });
    for (std::size_t k = 0; k < n; ++k) start[k + 1] += start[k];
    std::vector<int> next(start.begin(), start.end() - 1);
    each([&](int row, std::size_t column, double value) {
      const auto to = static_cast<std::size_t>(next[column]++);
      rows[to] = row;
      values[to] = value;
    });
  }

  /// Into `factor`, which ends up simplicial, as if CHOLMOD had made it.
  void factorize_supernodes(const Eigen::SparseMatrix<double>& m) {
    permute(m);
    cholmod_free_factor(&factor, &common);
    factor = cholmod_copy_factor(pattern, &common);
    if (!factor || !cholmod_change_factor(CHOLMOD_REAL, 1, 1, 1, 1, factor, &common)) return;
    const Supernodes nodes{static_cast<int>(factor->n),
                           static_cast<int>(factor->nsuper),
                           static_cast<const int*>(factor->super),
                           static_cast<const int*>(factor->pi),
                           static_cast<const int*>(factor->px),
                           static_cast<const int*>(factor->s)};
    const FactorColumns a{nodes.n, start.data(), rows.data(), values.data()};
    factor->minor = static_cast<std::size_t>(
        field_core::factorize_supernodes(nodes, a, static_cast<double*>(factor->x)));
    if (factor->minor == factor->n) {
      cholmod_change_factor(CHOLMOD_REAL, 1, 0, 1, 1, factor, &common);
    }
  }

  void require_factor() const {
    if (!ready) throw NumericalError("no matrix is factorized; call factorize() first");
  }

  cholmod_common common;
  bool supernodal;
  cholmod_factor *factor = nullptr, *pattern = nullptr;  // pattern: analysed supernodes
  cholmod_dense *solution = nullptr, *workspace_y = nullptr, *workspace_e = nullptr;
  std::vector<int> outer, inner;  // what was analysed
  std::vector<int> start, rows;   // of permute()
  std::vector<double> values;
  std::vector<int> block;  // variables eliminated last
  std::size_t analyses = 0;
  bool ready = false;
};

SparseCholesky::SparseCholesky(Elimination elimination)
    : impl_(std::make_unique<Impl>(elimination)) {}
SparseCholesky::~SparseCholesky() = default;
SparseCholesky::SparseCholesky(SparseCholesky&&) noexcept = default;
SparseCholesky& SparseCholesky::operator=(SparseCholesky&&) noexcept = default;

void SparseCholesky::factorize(const Eigen::SparseMatrix<double>& lower) { factorize(lower, {}); }

void SparseCholesky::factorize(const Eigen::SparseMatrix<double>& lower,
                               const std::vector<int>& block) {
  impl_->ready = false;
  check_input(lower);
  cholmod_sparse view = view_of(lower);
  const bool same_block = impl_->block == block;
  impl_->block = block;
  if (!same_block || !impl_->same_pattern(lower)) impl_->analyse(view, lower);
  if (impl_->supernodal) {
    impl_->factorize_supernodes(lower);
    if (!impl_->factor) throw NumericalError("CHOLMOD could not factorize: not enough memory");
  } else {
    cholmod_factorize(&view, impl_->factor, &impl_->common);
  }
  const cholmod_factor& factor = *impl_->factor;
  if (impl_->common.status == CHOLMOD_NOT_POSDEF || factor.minor < factor.n) {
    const int column = static_cast<const int*>(factor.Perm)[factor.minor];
    throw NumericalError(
        "the " + std::to_string(factor.n) + " x " + std::to_string(factor.n) +
        " matrix is not positive definite: its pivot in column " + std::to_string(column) +
        " (counted from 0) is not positive; usually a variable without prior and measurement, two "
        "equal points, or a noise of 0; give it a prior or raise the noise");
  }
  if (impl_->common.status < CHOLMOD_OK) {
    throw NumericalError("CHOLMOD failed with status " + std::to_string(impl_->common.status) +
                         " (-2: not enough memory); use a smaller map");
  }
  impl_->ready = true;
}

Eigen::MatrixXd SparseCholesky::solve(const Eigen::Ref<const Eigen::MatrixXd>& rhs) const {
  impl_->require_factor();
  if (rhs.rows() != size()) {
    throw NumericalError("the right-hand side has " + std::to_string(rhs.rows()) +
                         " rows, the factorized matrix " + std::to_string(size()));
  }
  cholmod_dense view{};
  view.nrow = static_cast<std::size_t>(rhs.rows());
  view.ncol = static_cast<std::size_t>(rhs.cols());
  view.d = static_cast<std::size_t>(rhs.outerStride());
  view.nzmax = view.d * view.ncol;
  view.x = const_cast<double*>(rhs.data());
  view.xtype = CHOLMOD_REAL;
  view.dtype = CHOLMOD_DOUBLE;
  Impl& impl = *impl_;
  if (rhs.cols() == 0) return Eigen::MatrixXd(rhs.rows(), 0);
  if (!cholmod_solve2(CHOLMOD_A, impl.factor, &view, nullptr, &impl.solution, nullptr,
                      &impl.workspace_y, &impl.workspace_e, &impl.common)) {
    throw NumericalError("CHOLMOD could not solve: not enough memory");
  }
  return Eigen::Map<const Eigen::MatrixXd>(static_cast<const double*>(impl.solution->x), rhs.rows(),
                                           rhs.cols());
}

double SparseCholesky::log_determinant() const {
  impl_->require_factor();
  const auto* start = static_cast<const int*>(impl_->factor->p);
  const auto* value = static_cast<const double*>(impl_->factor->x);
  double sum = 0.0;  // the first entry of each column is the diagonal of L
  for (std::size_t j = 0; j < impl_->factor->n; ++j) sum += std::log(value[start[j]]);
  return 2.0 * sum;
}

Eigen::VectorXd SparseCholesky::inverse_diagonal() const {
  impl_->require_factor();
  const FactorColumns columns = columns_of(*impl_->factor);
  std::vector<double> z(columns.value, columns.value + columns.start[columns.n]);
  field_core::selected_inverse(columns, z.data());
  const auto* permutation = static_cast<const int*>(impl_->factor->Perm);
  Eigen::VectorXd diagonal(columns.n);
  for (int j = 0; j < columns.n; ++j) {
    diagonal[permutation[j]] = z[static_cast<std::size_t>(columns.start[j])];
  }
  return diagonal;
}

Eigen::SparseMatrix<double> SparseCholesky::selected_inverse(Eigen::SparseMatrix<double> pattern) {
  impl_->require_factor();
  const FactorColumns columns = columns_of(*impl_->factor);
  if (pattern.rows() != columns.n || pattern.cols() != columns.n) {
    throw NumericalError("the pattern is not of the factor's size");
  }
  auto* z = static_cast<double*>(impl_->factor->x);
  field_core::selected_inverse(columns, z);
  impl_->ready = false;
  const auto* permutation = static_cast<const int*>(impl_->factor->Perm);
  std::vector<int> place(static_cast<std::size_t>(columns.n));
  for (int k = 0; k < columns.n; ++k) place[static_cast<std::size_t>(permutation[k])] = k;
  for (int column = 0; column < pattern.outerSize(); ++column) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(pattern, column); it; ++it) {
      const int a = place[static_cast<std::size_t>(it.row())];
      const int b = place[static_cast<std::size_t>(column)];
      const int *begin = columns.row + columns.start[std::min(a, b)],
                *end = columns.row + columns.start[std::min(a, b) + 1];
      const int* at = std::lower_bound(begin, end, std::max(a, b));
      if (at == end || *at != std::max(a, b)) {
        throw NumericalError("the factor has no entry at row " + std::to_string(it.row()) +
                             ", column " + std::to_string(column));
      }
      it.valueRef() = z[at - columns.row];
    }
  }
  return pattern;
}

Eigen::MatrixXd SparseCholesky::block_covariance() const {
  impl_->require_factor();
  const auto size = static_cast<Eigen::Index>(impl_->block.size());
  if (size == 0) throw NumericalError("no block was kept for last; name it in factorize()");
  const FactorColumns columns = columns_of(*impl_->factor);
  const auto* permutation = static_cast<const int*>(impl_->factor->Perm);
  const int first = columns.n - static_cast<int>(size);
  const Eigen::MatrixXd inverse = corner_inverse(columns, first);
  std::vector<Eigen::Index> place(static_cast<std::size_t>(columns.n));
  for (Eigen::Index k = 0; k < size; ++k) {
    place[static_cast<std::size_t>(permutation[first + k])] = k;
  }
  std::vector<Eigen::Index> from;
  for (const int k : impl_->block) from.push_back(place[static_cast<std::size_t>(k)]);
  Eigen::MatrixXd covariance(size, size);
  for (Eigen::Index b = 0; b < size; ++b) {
    const double* column = inverse.col(from[static_cast<std::size_t>(b)]).data();
    double* to = covariance.col(b).data();
    for (Eigen::Index a = 0; a < size; ++a) to[a] = column[from[static_cast<std::size_t>(a)]];
  }
  return covariance;
}

Eigen::Index SparseCholesky::size() const {
  return impl_->ready ? static_cast<Eigen::Index>(impl_->factor->n) : 0;
}

std::size_t SparseCholesky::analyses() const { return impl_->analyses; }

}  // namespace field_core
