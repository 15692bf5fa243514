#include "window_field.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>

#include "field_core/errors.hpp"

namespace gmrf_slap {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Sparse = Eigen::SparseMatrix<double>;
using Triplets = std::vector<Eigen::Triplet<double>>;

Eigen::Index index_of(std::size_t k) { return static_cast<Eigen::Index>(k); }

/// Adds the sites within `reach` steps along one axis of those that `out` held.
void widen(const Lattice& lattice, int reach, int dx, int dy, SiteSet& out) {
  const int nx = lattice.nx(), ny = lattice.ny(), held = out.size();
  for (int k = 0; k < held; ++k) {
    const int s = out.sites()[static_cast<std::size_t>(k)];
    for (int d = -reach; d <= reach; ++d) {
      int i = s % nx + d * dx, j = s / nx + d * dy;
      if (lattice.wrap()) {
        i = (i % nx + nx) % nx;
        j = (j % ny + ny) % ny;
      }
      if (i >= 0 && j >= 0 && i < nx && j < ny) out.insert(lattice.site(i, j));
    }
  }
}

/// Sites within `reach` rows and columns of given ones, into an empty set.
void insert_around(const Lattice& lattice, const std::vector<int>& sites, int reach, SiteSet& out) {
  for (const int s : sites) out.insert(s);
  widen(lattice, reach, 1, 0, out);
  widen(lattice, reach, 0, 1, out);
}

}  // namespace

WindowField::WindowField(const Lattice& lattice, const Sparse& precision,
                         const WindowSettings& settings)
    : lattice_(lattice),
      settings_(settings),
      precision_(precision),
      information_(VectorXd::Zero(lattice.sites())),
      last_mean_(information_),
      window_(lattice.sites()),
      patch_(lattice.sites()) {
  // Rows between sites need the covariances of a cell's diagonals from the
  // selected inverse.
  for (int s = 0; s < lattice.sites(); ++s) {
    const int i = s % lattice.nx(), j = s / lattice.nx();
    if (!lattice.wrap() && (i + 1 >= lattice.nx() || j + 1 >= lattice.ny())) continue;
    const int right = (i + 1) % lattice.nx(), up = (j + 1) % lattice.ny();
    add_both(s, lattice.site(right, up), 0.0);
    add_both(lattice.site(right, j), lattice.site(i, up), 0.0);
  }
}

SiteRow WindowField::localized(const SiteRow& row) const {
  SiteRow out = row;
  for (std::size_t a = 0; a < static_cast<std::size_t>(row.count); ++a) {
    out.site[a] = window_.find(row.site[a]);
    if (out.site[a] < 0) {
      throw field_core::NumericalError("site " + std::to_string(row.site[a]) +
                                       " is not in the window; call focus() first");
    }
  }
  return out;
}

void WindowField::localize(const SiteRow* rows, int count) const {
  local_.resize(std::max(local_.size(), static_cast<std::size_t>(count)));
  for (int k = 0; k < count; ++k) local_[static_cast<std::size_t>(k)] = localized(rows[k]);
}

bool WindowField::covers(const std::vector<int>& sites) const {
  return std::all_of(sites.begin(), sites.end(), [this](int s) { return window_.find(s) >= 0; });
}

bool WindowField::focus(const std::vector<int>& sites) {
  focused_.push_back(sites);
  if (static_cast<int>(focused_.size()) > settings_.memory) focused_.erase(focused_.begin());
  if (covers(sites)) return false;
  flush();
  take_window();
  return true;
}

void WindowField::note_pairs(const MixtureUpdate& update) {
  const auto size = static_cast<std::size_t>(window_.size());
  std::vector<std::size_t> touched;
  for (int k = 0; k < update.size; ++k) {
    const SiteRow& row = update.rows[static_cast<std::size_t>(k)];
    for (std::size_t a = 0; a < static_cast<std::size_t>(row.count); ++a) {
      touched.push_back(static_cast<std::size_t>(row.site[a]));
    }
  }
  std::sort(touched.begin(), touched.end());
  touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
  for (const std::size_t a : touched) {
    for (const std::size_t b : touched) pairs_[a * size + b] = 1;
  }
}

void WindowField::condition(const MixtureUpdate& update) {
  MixtureUpdate local = update;
  for (int k = 0; k < update.size; ++k) {
    local.rows[static_cast<std::size_t>(k)] = localized(update.rows[static_cast<std::size_t>(k)]);
  }
  note_pairs(local);
  block_.condition(local);
  global_.reset();
}

WindowField::Gain WindowField::gain() const {
  Gain out;
  const auto size = static_cast<std::size_t>(window_.size());
  for (std::size_t k = 0; k < size; ++k) {
    if (pairs_[k * size + k]) out.places.push_back(static_cast<int>(k));
  }
  const Eigen::Index n = index_of(out.places.size());
  if (n == 0) return out;
  MatrixXd now(n, n), before(n, n);
  VectorXd mean(n), mean_before(n);
  for (Eigen::Index a = 0; a < n; ++a) {
    const int i = out.places[static_cast<std::size_t>(a)];
    mean[a] = block_.mean()[i];
    mean_before[a] = old_mean_[i];
    for (Eigen::Index b = 0; b < n; ++b) {
      const int j = out.places[static_cast<std::size_t>(b)];
      now(a, b) = block_.at(i, j);
      before(a, b) = old_sigma_(std::max(i, j), std::min(i, j));
    }
  }
  const Eigen::LLT<MatrixXd> after_factor(now), before_factor(before);
  if (after_factor.info() != Eigen::Success || before_factor.info() != Eigen::Success) {
    throw field_core::NumericalError(
        "the covariance of the window is not positive definite; raise "
        "measurement_stddev or alpha");
  }
  const MatrixXd identity = MatrixXd::Identity(n, n);
  out.precision = after_factor.solve(identity) - before_factor.solve(identity);
  out.information = after_factor.solve(mean) - before_factor.solve(mean_before);
  return out;
}

void WindowField::flush() {
  const Gain learned = gain();
  const auto size = static_cast<std::size_t>(window_.size());
  for (std::size_t a = 0; a < learned.places.size(); ++a) {
    const auto i = static_cast<std::size_t>(learned.places[a]);
    const int site = window_.sites()[i];
    information_[site] += learned.information[index_of(a)];
    for (std::size_t b = 0; b <= a; ++b) {
      const auto j = static_cast<std::size_t>(learned.places[b]);
      if (!pairs_[i * size + j]) continue;  // exactly 0 but for rounding
      const double change = 0.5 * (learned.precision(index_of(a), index_of(b)) +
                                   learned.precision(index_of(b), index_of(a)));
      add_both(site, window_.sites()[j], change);
    }
  }
}

void WindowField::take_window() {
  window_.clear();
  std::vector<int> asked;
  for (const std::vector<int>& sites : focused_) {
    asked.insert(asked.end(), sites.begin(), sites.end());
  }
  insert_around(lattice_, asked, settings_.margin, window_);
  if (window_.size() > settings_.largest_window) {
    throw field_core::NumericalError(
        "the robots' possible positions spread over " + std::to_string(window_.size()) +
        " sites, the window holds " + std::to_string(settings_.largest_window) +
        "; shorten lag, give a better initial pose, or use engine: dense");
  }
  patch_.clear();
  if (settings_.halo < 0) {
    for (int s = 0; s < sites(); ++s) patch_.insert(s);
  } else {
    insert_around(lattice_, window_.sites(), settings_.halo, patch_);
  }
  // p(patch | everything else at its last mean): the patch's block of Q.
  Triplets entries;
  VectorXd rhs(patch_.size());
  for (int k = 0; k < patch_.size(); ++k) {
    const int site = patch_.sites()[static_cast<std::size_t>(k)];
    rhs[k] = information_[site];
    for (const SparseRows::Entry& e : precision_.row(site)) {
      const int place = patch_.find(e.column);
      if (place >= k) entries.emplace_back(place, k, e.value);
      if (place < 0) rhs[k] -= e.value * last_mean_[e.column];
    }
  }
  Sparse lower(patch_.size(), patch_.size());
  lower.setFromTriplets(entries.begin(), entries.end());
  std::vector<int> block;
  for (const int s : window_.sites()) block.push_back(patch_.find(s));
  field_core::SparseCholesky factor;
  factor.factorize(lower, block);
  const VectorXd mean = factor.solve(rhs);
  for (int k = 0; k < patch_.size(); ++k) {
    last_mean_[patch_.sites()[static_cast<std::size_t>(k)]] = mean[k];
  }
  old_mean_.resize(window_.size());
  for (int k = 0; k < window_.size(); ++k) {
    old_mean_[k] = mean[block[static_cast<std::size_t>(k)]];
  }
  old_sigma_ = factor.block_covariance();
  block_ = DenseBlock(old_mean_, old_sigma_);
  pairs_.assign(static_cast<std::size_t>(window_.size()) * static_cast<std::size_t>(window_.size()),
                0);
}

const WindowField::Global& WindowField::global() const {
  if (global_) return *global_;
  auto made = std::make_shared<Global>();
  const Gain learned = gain();
  Triplets entries;
  entries.reserve(precision_.entries());
  VectorXd information = information_;
  for (int s = 0; s < sites(); ++s) {
    for (const SparseRows::Entry& e : precision_.row(s)) {
      if (e.column >= s) entries.emplace_back(e.column, s, e.value);
    }
  }
  for (std::size_t a = 0; a < learned.places.size(); ++a) {
    const int i = window_.sites()[static_cast<std::size_t>(learned.places[a])];
    information[i] += learned.information[index_of(a)];
    for (std::size_t b = 0; b <= a; ++b) {
      const int j = window_.sites()[static_cast<std::size_t>(learned.places[b])];
      entries.emplace_back(std::max(i, j), std::min(i, j),
                           learned.precision(index_of(a), index_of(b)));
    }
  }
  Sparse lower(sites(), sites());
  lower.setFromTriplets(entries.begin(), entries.end());
  made->factor = std::make_shared<field_core::SparseCholesky>();
  made->factor->factorize(lower);
  made->mean = made->factor->solve(information);
  made->inverse = made->factor->selected_inverse();
  global_ = made;
  return *global_;
}

void WindowField::survey(const SiteRow* rows, int count, double* mean, double* variance) const {
  const Global& all = global();
  for (int k = 0; k < count; ++k) {
    const SiteRow& row = rows[k];
    mean[k] = row.dot(all.mean);
    variance[k] = 0.0;
    for (std::size_t a = 0; a < static_cast<std::size_t>(row.count); ++a) {
      for (std::size_t b = 0; b < static_cast<std::size_t>(row.count); ++b) {
        const int i = row.site[a], j = row.site[b];
        variance[k] +=
            row.weight[a] * row.weight[b] * all.inverse.coeff(std::max(i, j), std::min(i, j));
      }
    }
  }
}

std::size_t window_field_bytes(int sites) {
  // A stencil of 13 (order 2) in rows that have grown one by one, and seven
  // numbers per site.
  return static_cast<std::size_t>(sites) * (24 + 24 * sizeof(SparseRows::Entry) + 7 * 8);
}

std::unique_ptr<GaussianField> make_window_field(const Lattice& lattice, const Sparse& precision,
                                                 const WindowSettings& settings) {
  return std::make_unique<WindowField>(lattice, precision, settings);
}

}  // namespace gmrf_slap
