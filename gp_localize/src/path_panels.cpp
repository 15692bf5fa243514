#include "path_panels.hpp"

#include <algorithm>
#include <cmath>

#include "hypothesis_kernels.hpp"

namespace gp_localize {
namespace {

template <class T>
class Panels final : public PathPanels {
 public:
  Panels(const SupportBasis& basis, int paths, int slice_size, Recent recent) : recent_(recent) {
    const int m = static_cast<int>(basis.size());
    const std::size_t panels = (paths + kPanel<T> - 1) / kPanel<T>;
    const std::size_t lanes = panels * kPanel<T>;
    const std::size_t slots = lanes * slice_size;
    const std::size_t sizes[kArrays] = {lanes * m * (m + 1) / 2, lanes * m, slots, slots, slots * m,
                                        slots * slice_size,      slots,     lanes};
    std::size_t total = 0;
    for (const std::size_t size : sizes) total += size;
    memory_.assign(total, T(0));
    T* at[kArrays];
    T* next = memory_.data();
    for (int i = 0; i < kArrays; next += sizes[i], ++i) at[i] = next;
    const auto& kernel = basis.kernel();
    p_ = {kernel.type(),
          static_cast<T>(kernel.signal_variance()),
          m,
          0,
          slice_size,
          paths,
          static_cast<int>(panels),
          at[0],
          at[1],
          at[2],
          at[3],
          at[4],
          at[5],
          at[6],
          at[7]};
    std::fill(p_.weight, p_.weight + paths, T(1) / static_cast<T>(paths));
    scratch_.resize(scratch_size(m));
    path_features_.resize(m * lanes);
    path_x_.resize(lanes);
    path_y_.resize(lanes);
  }

  void assimilate(const Eigen::MatrixXd& summaries) override {
    const int packed = p_.support * (p_.support + 1) / 2;
    for (int c = 0; c < p_.panels * kPanel<T>; ++c) {
      const double* summary = summaries.col(std::min(c, p_.hypotheses - 1)).data();
      const long panel = c / kPanel<T>, lane = c % kPanel<T>;
      T* a = p_.covariance + panel * packed * kPanel<T> + lane;
      for (int k = 0; k < packed; ++k) a[k * kPanel<T>] = static_cast<T>(summary[k]);
      T* w = p_.mean + panel * p_.support * kPanel<T> + lane;
      for (int k = 0; k < p_.support; ++k) w[k * kPanel<T>] = static_cast<T>(summary[packed + k]);
    }
    p_.open = 0;
  }

  void extend(const SupportBasis& basis, const Eigen::Matrix2Xd& places, const Features& features,
              double value, double noise_variance) override {
    if (recent_ == Recent::ignored) return;
    const int lanes = p_.panels * kPanel<T>;
    for (int c = 0; c < lanes; ++c) {
      const int path = std::min(c, p_.hypotheses - 1);
      place(basis, places, path, path_x_[c], path_y_[c]);
    }
    for (int k = 0; k < p_.support; ++k) {
      const double* row = features.data() + k * features.cols();
      T* out = path_features_.data() + static_cast<long>(k) * lanes;
      for (int c = 0; c < p_.hypotheses; ++c) out[c] = static_cast<T>(row[c]);
      std::fill(out + p_.hypotheses, out + lanes, out[p_.hypotheses - 1]);
    }
    extend_open_slice(p_, OpenRow<T>{path_features_.data(), path_x_.data(), path_y_.data(),
                                     static_cast<T>(value), static_cast<T>(noise_variance)});
  }

  void weight(const std::vector<double>& weights) override {
    std::transform(weights.begin(), weights.end(), p_.weight,
                   [](double w) { return static_cast<T>(w); });
  }

  void begin(int particles) override {
    count_ = particles;
    log_densities_.assign(static_cast<std::size_t>(particles) * p_.panels * kPanel<T>, T(0));
  }

  void add(const SupportBasis& basis, const Eigen::Matrix2Xd& places, const Features& features,
           double value, double noise_variance, PathPanels* total,
           Eigen::Matrix2Xd& moments) override {
    const auto n = static_cast<int>(places.cols());
    features_.resize(static_cast<std::size_t>(p_.support) * n);
    std::transform(features.data(), features.data() + features_.size(), features_.begin(),
                   [](double f) { return static_cast<T>(f); });
    residual_.resize(n);
    x_.resize(n);
    y_.resize(n);
    moments_.resize(2 * static_cast<std::size_t>(n));
    const double prior = basis.kernel().signal_variance();
    for (int p = 0; p < n; ++p) {
      place(basis, places, p, x_[p], y_[p]);
      const double explained = features.col(p).squaredNorm();
      residual_[p] = static_cast<T>(std::max(0.0, prior - explained) + noise_variance);
    }
    T* sums = total ? static_cast<Panels*>(total)->log_densities_.data() : nullptr;
    add_log_densities(
        p_, ParticleBatch<T>{n, n, features_.data(), residual_.data(), x_.data(), y_.data(),
                             static_cast<T>(value), sums, moments_.data(), scratch_.data()});
    moments.resize(2, n);
    for (int i = 0; i < 2 * n; ++i) moments.data()[i] = moments_[i];
  }

  void log_mean(std::vector<double>& out) const override {
    out.resize(count_);
    log_mean_exp(log_densities_.data(), count_, p_.hypotheses, p_.panels * kPanel<T>, out.data());
  }

 private:
  static constexpr int kArrays = 8;

  /// In length scales from a point of the support: numbers small enough for single precision.
  static void place(const SupportBasis& basis, const Eigen::Matrix2Xd& places, int i, T& x, T& y) {
    const Eigen::Vector2d s =
        (places.col(i) - basis.support().col(0)).cwiseQuotient(basis.kernel().length_scales());
    x = static_cast<T>(s.x());
    y = static_cast<T>(s.y());
  }

  Recent recent_;
  HypothesisPanels<T> p_;
  std::vector<T> memory_;
  std::vector<T> scratch_, features_, residual_, x_, y_, moments_;
  std::vector<T> path_features_, path_x_, path_y_;
  std::vector<T> log_densities_;
  int count_ = 0;
};

}  // namespace

void extend_by_open_rows(const SupportBasis& basis, const std::vector<const OnlineSparseGp*>& maps,
                         PathPanels& panels) {
  Eigen::Matrix2Xd places(2, maps.size());
  Features features(basis.size(), static_cast<Eigen::Index>(maps.size()));
  const OnlineSparseGp& any = *maps.front();
  for (int i = 0; i < any.open(); ++i) {
    for (std::size_t c = 0; c < maps.size(); ++c) {
      places.col(c) = maps[c]->open_point(i);
      features.col(c) = Eigen::Map<const Eigen::VectorXd>(maps[c]->open_features(i), basis.size());
    }
    panels.extend(basis, places, features, any.open_value(i), any.open_noise(i));
  }
}

std::unique_ptr<PathPanels> make_path_panels(const SupportBasis& basis, int paths, int slice_size,
                                             Recent recent, Precision precision) {
  if (precision == Precision::single_precision) {
    return std::make_unique<Panels<float>>(basis, paths, slice_size, recent);
  }
  return std::make_unique<Panels<double>>(basis, paths, slice_size, recent);
}

}  // namespace gp_localize
