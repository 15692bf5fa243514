#include "window_field.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "field_core/cholmod.hpp"
#include "field_core/errors.hpp"
#include "field_core/positive_inverse.hpp"
#include "site_list.hpp"

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

field_core::SparseCholesky factorized(const Sparse& lower) {
  field_core::SparseCholesky factor(field_core::Elimination::supernodal);
  factor.factorize(lower);
  return factor;
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

bool WindowField::focus(const std::vector<int>& sites, const std::vector<int>& ahead) {
  focused_.push_back({sites, ahead});
  if (static_cast<int>(focused_.size()) > settings_.memory) focused_.erase(focused_.begin());
  if (covers(sites)) return false;
  choose_sites();
  take_window();
  return true;
}

WindowField::Touched WindowField::touched_by(const MixtureUpdate& update) const {
  Touched out;
  for (int k = 0; k < update.size; ++k) {
    add_sites(update.rows[static_cast<std::size_t>(k)], out.sites);
  }
  sort_unique(out.sites);
  for (const int s : out.sites) out.places.push_back(window_.find(s));
  const Eigen::Index n = index_of(out.places.size());
  out.sigma.resize(n, n);
  out.mean.resize(n);
  look_again(out);
  return out;
}

void WindowField::look_again(Touched& touched) const {
  for (Eigen::Index b = 0; b < touched.mean.size(); ++b) {
    const int j = touched.places[static_cast<std::size_t>(b)];
    touched.mean[b] = block_.mean()[j];
    for (Eigen::Index a = b; a < touched.mean.size(); ++a) {
      touched.sigma(a, b) = block_.at(touched.places[static_cast<std::size_t>(a)], j);
    }
  }
}

void WindowField::condition(const MixtureUpdate& update) {
  MixtureUpdate local = update;
  for (int k = 0; k < update.size; ++k) {
    local.rows[static_cast<std::size_t>(k)] = localized(update.rows[static_cast<std::size_t>(k)]);
  }
  const Touched before = touched_by(update);
  block_.condition(local);
  Touched after = before;
  look_again(after);
  learn(before, after);
  global_.reset();
}

/// Q += (Sigma'_UU)^-1 - (Sigma_UU)^-1, and the same for Q mean.
void WindowField::learn(const Touched& before, const Touched& after) {
  MatrixXd precision = field_core::positive_inverse(after.sigma);
  const MatrixXd precision_before = field_core::positive_inverse(before.sigma);
  if (precision.size() == 0 || precision_before.size() == 0) {
    throw field_core::NumericalError(
        "the covariance of the window is not positive definite; raise "
        "measurement_stddev or alpha");
  }
  const VectorXd information = precision * after.mean - precision_before * before.mean;
  precision -= precision_before;  // exactly symmetric
  for (Eigen::Index a = 0; a < information.size(); ++a) {
    const int site = after.sites[static_cast<std::size_t>(a)];
    information_[site] += information[a];
    precision_.add(site, after.sites, precision.col(a).data());
  }
}

/// The window: all that was asked for and a margin where robots are. The patch: everything within
/// margin and halo of what was asked for.
void WindowField::choose_sites() {
  std::vector<int> asked, ahead;
  for (const Focus& focus : focused_) {
    asked.insert(asked.end(), focus.sites.begin(), focus.sites.end());
    ahead.insert(ahead.end(), focus.ahead.begin(), focus.ahead.end());
  }
  const std::vector<int> before = window_.sites();
  window_.clear();
  insert_around(lattice_, ahead, settings_.margin, window_);
  for (const int s : asked) window_.insert(s);
  if (sites() <= settings_.grow_up_to) {
    for (const int s : before) window_.insert(s);
    asked = window_.sites();
  }
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
    insert_around(lattice_, asked, settings_.margin + settings_.halo, patch_);
  }
}

void WindowField::take_window() {
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
  field_core::SparseCholesky factor(field_core::Elimination::supernodal);
  factor.factorize(lower, block);
  const VectorXd mean = factor.solve(rhs);
  for (int k = 0; k < patch_.size(); ++k) {
    last_mean_[patch_.sites()[static_cast<std::size_t>(k)]] = mean[k];
  }
  VectorXd window_mean(window_.size());
  for (int k = 0; k < window_.size(); ++k) {
    window_mean[k] = mean[block[static_cast<std::size_t>(k)]];
  }
  block_ = DenseBlock(std::move(window_mean), factor.block_covariance());
}

Sparse WindowField::lower() const {
  Triplets entries;
  entries.reserve(precision_.entries());
  for (int s = 0; s < sites(); ++s) {
    for (const SparseRows::Entry& e : precision_.row(s)) {
      if (e.column >= s) entries.emplace_back(e.column, s, e.value);
    }
  }
  Sparse q(sites(), sites());
  q.setFromTriplets(entries.begin(), entries.end());
  return q;
}

VectorXd WindowField::multiply(const VectorXd& x) const { return factorized(lower()).solve(x); }

const WindowField::Global& WindowField::global() const {
  if (global_) return *global_;
  auto made = std::make_shared<Global>();
  Sparse q = lower();
  field_core::SparseCholesky factor = factorized(q);
  made->mean = factor.solve(information_);
  made->inverse = factor.selected_inverse(std::move(q));
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
  // A stencil of 13 (order 2), as much again for what is learned, and six numbers per site.
  return static_cast<std::size_t>(sites) * (26 * sizeof(SparseRows::Entry) + 6 * 8);
}

std::unique_ptr<GaussianField> make_window_field(const Lattice& lattice, const Sparse& precision,
                                                 const WindowSettings& settings) {
  return std::make_unique<WindowField>(lattice, precision, settings);
}

}  // namespace gmrf_slap
