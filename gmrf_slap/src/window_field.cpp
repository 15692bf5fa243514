// The sparse and the local engine: a dense window above a sparse precision matrix.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>

#include "dense_block.hpp"
#include "field_core/cholmod.hpp"
#include "field_core/errors.hpp"
#include "gmrf_slap/gaussian_field.hpp"
#include "sparse_rows.hpp"

namespace gmrf_slap {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Sparse = Eigen::SparseMatrix<double>;
using Triplets = std::vector<Eigen::Triplet<double>>;

Eigen::Index index_of(std::size_t k) { return static_cast<Eigen::Index>(k); }

/// Which sites are in a set, and where; clearing costs as much as was in it.
class SiteSet {
 public:
  explicit SiteSet(int sites) : place_(static_cast<std::size_t>(sites), -1) {}
  int find(int site) const { return place_[static_cast<std::size_t>(site)]; }
  void insert(int site) {
    int& place = place_[static_cast<std::size_t>(site)];
    if (place >= 0) return;
    place = static_cast<int>(sites_.size());
    sites_.push_back(site);
  }
  void clear() {
    for (const int s : sites_) place_[static_cast<std::size_t>(s)] = -1;
    sites_.clear();
  }
  const std::vector<int>& sites() const { return sites_; }
  int size() const { return static_cast<int>(sites_.size()); }

 private:
  std::vector<int> place_, sites_;
};

/// Sites within `reach` rows and columns of given ones.
void insert_around(const Lattice& lattice, const std::vector<int>& sites, int reach, SiteSet& out) {
  const int nx = lattice.nx(), ny = lattice.ny();
  for (const int s : sites) {
    for (int dj = -reach; dj <= reach; ++dj) {
      for (int di = -reach; di <= reach; ++di) {
        int i = s % nx + di, j = s / nx + dj;
        if (lattice.wrap()) {
          i = (i % nx + nx) % nx;
          j = (j % ny + ny) % ny;
        }
        if (i >= 0 && j >= 0 && i < nx && j < ny) out.insert(lattice.site(i, j));
      }
    }
  }
}

class WindowField final : public GaussianField {
 public:
  WindowField(const Lattice& lattice, const Sparse& precision, const WindowSettings& settings)
      : lattice_(lattice),
        settings_(settings),
        precision_(precision),
        information_(VectorXd::Zero(lattice.sites())),
        last_mean_(information_),
        window_(lattice.sites()),
        patch_(lattice.sites()) {
    // Rows between sites need the covariances of a cell's diagonals from the selected inverse.
    for (int s = 0; s < lattice.sites(); ++s) {
      const int i = s % lattice.nx(), j = s / lattice.nx();
      if (!lattice.wrap() && (i + 1 >= lattice.nx() || j + 1 >= lattice.ny())) continue;
      const int right = (i + 1) % lattice.nx(), up = (j + 1) % lattice.ny();
      add_both(s, lattice.site(right, up), 0.0);
      add_both(lattice.site(right, j), lattice.site(i, up), 0.0);
    }
  }

  int sites() const override { return lattice_.sites(); }
  bool focus(const std::vector<int>& sites) override;
  void predict(const SiteRow* rows, int count, double* mean, double* variance) const override {
    localize(rows, count);
    block_.predict(local_.data(), count, mean, variance);
  }
  void covariances(const SiteRow& a, const SiteRow* b, int count, double* out) const override {
    localize(b, count);
    block_.covariances(localized(a), local_.data(), count, out);
  }
  void condition(const MixtureUpdate& update) override;

  VectorXd mean() const override { return global().mean; }
  VectorXd variances() const override { return global().inverse.diagonal(); }
  VectorXd multiply(const VectorXd& x) const override { return global().factor->solve(x); }
  void survey(const SiteRow* rows, int count, double* mean, double* variance) const override;

  std::unique_ptr<GaussianField> clone() const override {
    return std::make_unique<WindowField>(*this);
  }
  std::size_t memory_bytes() const override {
    return precision_.memory_bytes() + 2 * block_.memory_bytes() +
           8 * static_cast<std::size_t>(5 * sites() + old_sigma_.size());
  }
  void save(field_core::State& state, const std::string& prefix) const override;
  void restore(const field_core::State& state, const std::string& prefix) override;

 private:
  /// The whole field, made for maps and kept until something changes.
  struct Global {
    std::shared_ptr<field_core::SparseCholesky> factor;
    VectorXd mean;
    Sparse inverse;  // selected, lower
  };
  /// What the window has learned since it was taken from Q.
  struct Gain {
    std::vector<int> places;  // measured sites, as places in the window
    MatrixXd precision;
    VectorXd information;
  };

  void add_both(int i, int j, double value) {
    precision_.add(i, j, value);
    if (i != j) precision_.add(j, i, value);
  }
  SiteRow localized(const SiteRow& row) const;
  void localize(const SiteRow* rows, int count) const;
  bool covers(const std::vector<int>& sites) const;
  Gain gain() const;
  void flush();
  void take_window();
  void note_pairs(const MixtureUpdate& update);
  const Global& global() const;

  Lattice lattice_;
  WindowSettings settings_;
  SparseRows precision_;  // Q without the window's gain
  VectorXd information_;  // Q mean, the same
  VectorXd last_mean_;    // of each site when it was last in a patch
  SiteSet window_, patch_;
  std::vector<std::vector<int>> focused_;  // latest last
  DenseBlock block_;                       // the window's marginal
  MatrixXd old_sigma_;                     // of the window when it was taken
  VectorXd old_mean_;
  std::vector<unsigned char> pairs_;  // window x window: changed by a measurement
  mutable std::vector<SiteRow> local_;
  mutable std::shared_ptr<const Global> global_;
};

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
        "the covariance of the window is not positive definite; raise measurement_stddev or alpha");
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
  for (const std::vector<int>& sites : focused_) {
    insert_around(lattice_, sites, settings_.margin, window_);
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
    state.set(prefix + "focus" + std::to_string(f), as_matrix(focused_[f]));
  }
  const Eigen::Index n = window_.size();
  state.set(prefix + "window_mean", block_.mean());
  state.set(prefix + "window_covariance", block_.sigma());
  state.set(prefix + "old_mean", old_mean_);
  state.set(prefix + "old_covariance", old_sigma_);
  MatrixXd pairs(n, n);
  for (Eigen::Index i = 0; i < pairs.size(); ++i) pairs(i) = pairs_[static_cast<std::size_t>(i)];
  state.set(prefix + "pairs", pairs);
}

void WindowField::restore(const field_core::State& state, const std::string& prefix) {
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
  next.information_ = state.matrix(prefix + "information", sites(), 1);
  next.last_mean_ = state.matrix(prefix + "last_mean", sites(), 1);
  for (const int s : as_sites("window")) next.window_.insert(s);
  const Eigen::Index n = next.window_.size();
  for (int f = 0; f < static_cast<int>(state.scalar(prefix + "focused")); ++f) {
    next.focused_.push_back(as_sites("focus" + std::to_string(f)));
  }
  if (n > 0) {
    next.old_mean_ = state.matrix(prefix + "old_mean", n, 1);
    next.old_sigma_ = state.matrix(prefix + "old_covariance", n, n);
    const VectorXd mean = state.matrix(prefix + "window_mean", n, 1);
    next.block_ = DenseBlock(mean, state.matrix(prefix + "window_covariance", n, n));
    const MatrixXd& pairs = state.matrix(prefix + "pairs", n, n);
    for (Eigen::Index i = 0; i < pairs.size(); ++i) next.pairs_.push_back(pairs(i) > 0.0);
  }
  *this = std::move(next);
}

}  // namespace

std::size_t window_field_bytes(int sites) {
  // A stencil of 13 (order 2) in rows that have grown one by one, and seven numbers per site.
  return static_cast<std::size_t>(sites) * (24 + 24 * sizeof(SparseRows::Entry) + 7 * 8);
}

std::unique_ptr<GaussianField> make_window_field(const Lattice& lattice, const Sparse& precision,
                                                 const WindowSettings& settings) {
  return std::make_unique<WindowField>(lattice, precision, settings);
}

}  // namespace gmrf_slap
