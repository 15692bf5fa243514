// The sparse and the local engine: a dense window above a sparse precision
// matrix (WindowSettings in gaussian_field.hpp tells how).
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <memory>
#include <string>
#include <vector>

#include "dense_block.hpp"
#include "gmrf_slap/gaussian_field.hpp"
#include "sparse_rows.hpp"

namespace gmrf_slap {

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

class WindowField final : public GaussianField {
 public:
  WindowField(const Lattice& lattice, const Eigen::SparseMatrix<double>& precision,
              const WindowSettings& settings);

  int sites() const override { return lattice_.sites(); }
  bool focus(const std::vector<int>& sites, const std::vector<int>& ahead) override;
  void predict(const SiteRow* rows, int count, double* mean, double* variance) const override {
    localize(rows, count);
    block_.predict(local_.data(), count, mean, variance);
  }
  void covariances(const SiteRow& a, const SiteRow* b, int count, double* out) const override {
    localize(b, count);
    block_.covariances(localized(a), local_.data(), count, out);
  }
  void condition(const MixtureUpdate& update) override;

  Eigen::VectorXd mean() const override { return global().mean; }
  Eigen::VectorXd variances() const override { return global().inverse.diagonal(); }
  Eigen::VectorXd multiply(const Eigen::VectorXd& x) const override;
  void survey(const SiteRow* rows, int count, double* mean, double* variance) const override;

  std::unique_ptr<GaussianField> clone() const override {
    return std::make_unique<WindowField>(*this);
  }
  std::size_t memory_bytes() const override {
    return precision_.memory_bytes() + block_.memory_bytes() +
           8 * static_cast<std::size_t>(4 * sites());
  }
  void save(field_core::State& state, const std::string& prefix) const override;
  void restore(const field_core::State& state, const std::string& prefix) override;

 private:
  /// The whole field, made for maps and kept until something changes; without the factor, which is
  /// the largest part by far.
  struct Global {
    Eigen::VectorXd mean;
    Eigen::SparseMatrix<double> inverse;  // at the entries of Q, lower
  };
  /// The sites of one call of focus(), and those of them that the margin is around.
  struct Focus {
    std::vector<int> sites, ahead;
  };
  /// Sites that a measurement touched, ascending, and their marginal before or after it.
  struct Touched {
    std::vector<int> sites, places;  // of the grid, in the window
    Eigen::MatrixXd sigma;           // lower triangle
    Eigen::VectorXd mean;
  };

  void add_both(int i, int j, double value) {
    precision_.add(i, j, value);
    if (i != j) precision_.add(j, i, value);
  }
  SiteRow localized(const SiteRow& row) const;
  void localize(const SiteRow* rows, int count) const;
  bool covers(const std::vector<int>& sites) const;
  Touched touched_by(const MixtureUpdate& update) const;
  void look_again(Touched& touched) const;
  void learn(const Touched& before, const Touched& after);
  void choose_sites();
  void take_window();
  /// Q, its lower triangle.
  Eigen::SparseMatrix<double> lower() const;
  const Global& global() const;

  Lattice lattice_;
  WindowSettings settings_;
  SparseRows precision_;         // Q
  Eigen::VectorXd information_;  // Q mean
  Eigen::VectorXd last_mean_;    // of each site when it was last in a patch
  SiteSet window_, patch_;
  std::vector<Focus> focused_;  // latest last
  DenseBlock block_;            // the window's marginal
  mutable std::vector<SiteRow> local_;
  mutable std::shared_ptr<const Global> global_;
};

}  // namespace gmrf_slap
