#include "path_panels.hpp"

#include <algorithm>
#include <cmath>

#include "hypothesis_kernels.hpp"
#include "interpolation_box.hpp"
#include "vector_kernels.hpp"

namespace gp_localize {
namespace {

template <class T>
class Panels final : public PathPanels {
 public:
  Panels(const SupportBasis& basis, int paths, int slice_size, Recent recent,
         double interpolation_tolerance)
      : recent_(recent), tolerance_(interpolation_tolerance) {
    slice_size *= basis.fields();
    const int m = static_cast<int>(basis.size());
    const std::size_t panels = (paths + kPanel<T> - 1) / kPanel<T>;
    const std::size_t lanes = panels * kPanel<T>;
    const std::size_t slots = lanes * slice_size;
    const int d = basis.dimensions();
    const std::size_t sizes[kArrays] = {lanes * m * (m + 1) / 2, lanes * m, slots * d, slots * m,
                                        slots * slice_size,      slots,     lanes};
    std::size_t total = 0;
    for (const std::size_t size : sizes) total += size;
    memory_.assign(total, T(0));
    T* at[kArrays];
    T* next = memory_.data();
    for (int i = 0; i < kArrays; next += sizes[i], ++i) at[i] = next;
    const auto& kernel = basis.kernel();
    prior_.assign(slice_size, static_cast<T>(basis.prior(0, 0)));
    open_fields_.assign(slice_size, 0);
    p_ = {kernel.type(),
          prior_.data(),
          d,
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
          at[6]};
    std::fill(p_.weight, p_.weight + paths, T(1) / static_cast<T>(paths));
    scratch_.resize(std::max(scratch_size(m), kBatch * kMostNodes));
    path_features_.resize(m * lanes);
    path_place_.resize(d * lanes);
    if (tolerance_ == 0.0) return;
    node_mean_.reserve(kMostNodes * lanes);
    node_variance_.reserve(kMostNodes * lanes);
  }

  void assimilate(const Eigen::MatrixXd& summaries) override {
    const int packed = p_.support * (p_.support + 1) / 2;
    mean_norm_ = std::sqrt(summaries.bottomRows(p_.support).colwise().squaredNorm().maxCoeff());
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

  void extend(const SupportBasis& basis, const Places& places, const Features& features,
              double value, double noise_variance) override {
    if (recent_ == Recent::ignored) return;
    open_fields_[p_.open] = basis.field_of(places.col(0));
    set_prior(basis, Combination{open_fields_[p_.open]}, p_.open + 1);
    const int lanes = p_.panels * kPanel<T>;
    for (int c = 0; c < lanes; ++c) {
      const int path = std::min(c, p_.hypotheses - 1);
      place(basis, places, path, path_place_.data() + c, lanes);
    }
    for (int k = 0; k < p_.support; ++k) {
      const double* row = features.data() + k * features.cols();
      T* out = path_features_.data() + static_cast<long>(k) * lanes;
      for (int c = 0; c < p_.hypotheses; ++c) out[c] = static_cast<T>(row[c]);
      std::fill(out + p_.hypotheses, out + lanes, out[p_.hypotheses - 1]);
    }
    extend_open_slice(p_, OpenRow<T>{path_features_.data(), path_place_.data(),
                                     static_cast<T>(value), static_cast<T>(noise_variance)});
    T largest = 0;
    for (int panel = 0; panel < p_.panels; ++panel) {
      const T* row = p_.open_value + (panel * p_.slice_size + p_.open - 1) * kPanel<T>;
      for (int lane = 0; lane < kPanel<T>; ++lane) largest = std::max(largest, std::abs(row[lane]));
    }
    mean_norm_ += static_cast<double>(largest);
  }

  void weight(const std::vector<double>& weights) override {
    std::transform(weights.begin(), weights.end(), p_.weight,
                   [](double w) { return static_cast<T>(w); });
  }

  void begin(int particles) override {
    count_ = particles;
    log_densities_.assign(static_cast<std::size_t>(particles) * p_.panels * kPanel<T>, T(0));
  }

  void add(const SupportBasis& basis, const Places& places, double value, double noise_variance,
           PathPanels* total, Eigen::Matrix2Xd& moments) override {
    const auto n = static_cast<int>(places.cols());
    moments_.resize(2 * static_cast<std::size_t>(n));
    const Scores<T> scores{static_cast<T>(value),
                           total ? static_cast<Panels*>(total)->log_densities_.data() : nullptr,
                           moments_.data()};
    const Combination field{n > 0 ? basis.field_of(places.col(0)) : 0};
    set_prior(basis, field, p_.open);
    if (fit_box(basis, places, basis.prior(field.a, field.a), noise_variance)) {
      add_interpolated(basis, field, n, noise_variance, scores);
    } else {
      add_log_densities(p_, batch(basis, places, field, noise_variance), scores);
    }
    moments.resize(2, n);
    for (int i = 0; i < 2 * n; ++i) moments.data()[i] = moments_[i];
  }

  void add_joint(const SupportBasis& basis, const Places& places,
                 const std::vector<Reading>& readings, PathPanels* total,
                 std::vector<Eigen::Matrix2Xd>& moments) override {
    moments.resize(readings.size());
    for (Eigen::Matrix2Xd& m : moments) m.setZero(2, places.cols());
    for (Eigen::Index first = 0; first < places.cols(); first += kBatch) {
      const Eigen::Index count = std::min<Eigen::Index>(kBatch, places.cols() - first);
      predict_pairs(basis, places.middleCols(first, count), readings);
      for (int panel = 0; panel < p_.panels; ++panel) {
        for (Eigen::Index p = 0; p < count; ++p) {
          const long slot = (static_cast<long>(panel) * count + p) * kPanel<T>;
          T* sums = static_cast<Panels*>(total)->log_densities_.data() +
                    ((first + p) * p_.panels + panel) * kPanel<T>;
          for (int lane = 0; lane < kPanel<T>; ++lane) {
            sums[lane] += score_joint(readings, slot + lane, p_.weight[panel * kPanel<T> + lane],
                                      first + p, moments);
          }
        }
      }
    }
  }

  void log_mean(std::vector<double>& out) const override {
    out.resize(count_);
    log_mean_exp(log_densities_.data(), count_, p_.hypotheses, p_.panels * kPanel<T>, out.data());
  }

 private:
  static constexpr int kArrays = 7;
  static constexpr int kMostNodes = InterpolationBox::kMostNodes;
  static constexpr int kMostFields = 12;  // of a group

  /// What is predicted: a field of the group, or a weighted sum of two, which the model knows as
  /// well as it knows a field.
  struct Combination {
    int a, b = -1;
    double weight_a = 1.0, weight_b = 0.0;

    double with(const SupportBasis& basis, int field) const {
      const double one = weight_a * basis.prior(field, a);
      return b < 0 ? one : one + weight_b * basis.prior(field, b);
    }
    double variance(const SupportBasis& basis) const {
      const double one = weight_a * with(basis, a);
      return b < 0 ? one : one + weight_b * with(basis, b);
    }
  };

  void set_prior(const SupportBasis& basis, const Combination& what, int open) {
    for (int i = 0; i < open; ++i) {
      prior_[i] = static_cast<T>(what.with(basis, open_fields_[i]));
    }
  }

  /// Mean and variance of every reading's field at a few places, and of the sum of every two, each
  /// over its standard deviation: what that has more is twice their covariance.
  void predict_pairs(const SupportBasis& basis, const Eigen::Ref<const Places>& places,
                     const std::vector<Reading>& readings) {
    const auto n = static_cast<int>(places.cols());
    const std::size_t q = readings.size();
    pair_size_ = static_cast<std::size_t>(n) * p_.panels * kPanel<T>;
    pair_mean_.resize((q + 1) * pair_size_);  // the last is of sums, and not used
    pair_variance_.resize(q * q * pair_size_);
    const Eigen::Index d = places.rows();
    if (labelled_.cols() == 0) {
      labelled_.resize(d + 1, kBatch);
      second_places_.resize(d + 1, kBatch);
    }
    auto at = labelled_.leftCols(n);
    at.topRows(d) = places;
    for (std::size_t a = 0; a < q; ++a) {
      at.bottomRows(1).setConstant(readings[a].member);
      for (std::size_t b = 0; b <= a; ++b) {
        Combination what{readings[a].member};
        if (b < a) {
          const int other = readings[b].member;
          what = {what.a, other, 1.0 / std::sqrt(basis.prior(what.a, what.a)),
                  1.0 / std::sqrt(basis.prior(other, other))};
        }
        set_prior(basis, what, p_.open);
        NodePredictions<T> out{};
        out.nodes = n;
        out.mean = pair_mean_.data() + (b < a ? q : a) * pair_size_;
        out.variance = pair_variance_.data() + (a * q + b) * pair_size_;
        predict_nodes(p_, batch(basis, at, what, 0.0), out);
      }
    }
    for (std::size_t a = 0; a < q; ++a) {
      for (std::size_t b = 0; b < a; ++b) {
        to_covariance(basis, readings[a].member, readings[b].member, a, b, q);
      }
    }
  }

  void to_covariance(const SupportBasis& basis, int field_a, int field_b, std::size_t a,
                     std::size_t b, std::size_t q) {
    const double va = basis.prior(field_a, field_a), vb = basis.prior(field_b, field_b);
    const T ia = static_cast<T>(1.0 / va), ib = static_cast<T>(1.0 / vb);
    const T half = static_cast<T>(0.5 * std::sqrt(va * vb));
    const T* var_a = pair_variance_.data() + (a * q + a) * pair_size_;
    const T* var_b = pair_variance_.data() + (b * q + b) * pair_size_;
    T* pair = pair_variance_.data() + (a * q + b) * pair_size_;
    for (std::size_t i = 0; i < pair_size_; ++i) {
      pair[i] = half * (pair[i] - ia * var_a[i] - ib * var_b[i]);
    }
  }

  /// Log of the joint density of the readings for one place and path, at `i` of the predictions.
  T score_joint(const std::vector<Reading>& readings, std::size_t i, T weight, Eigen::Index place,
                std::vector<Eigen::Matrix2Xd>& moments) const {
    T l[kMostFields][kMostFields], whitened[kMostFields], sum = 0;
    const std::size_t q = readings.size();
    for (std::size_t a = 0; a < q; ++a) {
      const T* variances = pair_variance_.data() + a * q * pair_size_ + i;
      T mean = pair_mean_[a * pair_size_ + i];
      const T noise = static_cast<T>(readings[a].noise_variance);
      T variance = variances[a * pair_size_] + noise;
      for (std::size_t b = 0; b < a; ++b) {
        T rest = variances[b * pair_size_];
        for (std::size_t j = 0; j < b; ++j) rest -= l[a][j] * l[b][j];
        l[a][b] = rest / l[b][b];
        mean += l[a][b] * whitened[b];
        variance -= l[a][b] * l[a][b];
      }
      variance = std::max(variance, noise);  // below it by rounding only
      l[a][a] = std::sqrt(variance);
      whitened[a] = (static_cast<T>(readings[a].value) - mean) / l[a][a];
      sum -= T(0.5) * (whitened[a] * whitened[a] + std::log(variance));
      moments[a](0, place) += static_cast<double>(weight * mean);
      moments[a](1, place) += static_cast<double>(weight * (variance + mean * mean));
    }
    return sum;
  }

  /// Places with their features, in this precision. The memory is that of the object.
  PlaceBatch<T> batch(const SupportBasis& basis, const Eigen::Ref<const Places>& places,
                      const Combination& what, double noise_variance) {
    const auto n = static_cast<int>(places.cols());
    const std::size_t size = static_cast<std::size_t>(p_.support) * n;
    exact_features_.resize(size);
    features_.resize(size);
    residual_.resize(n);
    place_.resize(static_cast<std::size_t>(basis.dimensions()) * n);
    basis.features(places, exact_features_.data());
    if (what.b >= 0) add_second(basis, places, what);
    const double prior = what.variance(basis);
    for (int p = 0; p < n; ++p) {
      place(basis, places, p, place_.data() + p, n);
      double explained = 0.0;
      for (std::size_t k = p; k < size; k += n)
        explained += exact_features_[k] * exact_features_[k];
      residual_[p] = static_cast<T>(std::max(0.0, prior - explained) + noise_variance);
    }
    std::transform(exact_features_.begin(), exact_features_.end(), features_.begin(),
                   [](double f) { return static_cast<T>(f); });
    return {n, n, features_.data(), residual_.data(), place_.data(), scratch_.data()};
  }

  void add_second(const SupportBasis& basis, const Eigen::Ref<const Places>& places,
                  const Combination& what) {
    auto second = second_places_.leftCols(places.cols());
    second = places;
    second.bottomRows(1).setConstant(what.b);
    second_features_.resize(exact_features_.size());
    basis.features(second, second_features_.data());
    for (std::size_t i = 0; i < exact_features_.size(); ++i) {
      exact_features_[i] = what.weight_a * exact_features_[i] + what.weight_b * second_features_[i];
    }
  }

  bool fit_box(const SupportBasis& basis, const Places& places, double prior,
               double noise_variance) {
    const double pair = p_.support * (0.5 * p_.support + 1.5 + p_.open);
    return box_.fit_where_it_pays(basis.kernel(), places, tolerance_, noise_variance, prior,
                                  mean_norm_, pair);
  }

  void add_interpolated(const SupportBasis& basis, const Combination& field, int count,
                        double noise_variance, const Scores<T>& scores) {
    const auto nodes = static_cast<int>(box_.nodes().cols());
    node_mean_.resize(static_cast<std::size_t>(nodes) * p_.panels * kPanel<T>);
    node_variance_.resize(node_mean_.size());
    coefficients_.resize(box_.coefficients().size());
    std::transform(box_.coefficients().begin(), box_.coefficients().end(), coefficients_.begin(),
                   [](double c) { return static_cast<T>(c); });
    const NodePredictions<T> predictions{
        nodes,          node_mean_.data(),    node_variance_.data(),
        count,          coefficients_.data(), static_cast<T>(noise_variance),
        scratch_.data()};
    if (basis.fields() > 1) {
      if (labelled_nodes_.cols() == 0) labelled_nodes_.resize(3, kMostNodes);
      auto at = labelled_nodes_.leftCols(nodes);
      at.topRows(2) = box_.nodes();
      at.bottomRows(1).setConstant(field.a);
      predict_nodes(p_, batch(basis, at, field, 0.0), predictions);
    } else {
      predict_nodes(p_, batch(basis, box_.nodes(), field, 0.0), predictions);
    }
    add_interpolated_log_densities(p_, predictions, scores);
  }

  /// In length scales from a point of the support: numbers small enough for single precision.
  /// Coordinates are `stride` apart.
  static void place(const SupportBasis& basis, const Eigen::Ref<const Places>& places, int i,
                    T* out, int stride) {
    const Place s = (places.col(i).head(basis.dimensions()) - basis.support().col(0))
                        .cwiseQuotient(basis.kernel().length_scales());
    for (Eigen::Index a = 0; a < s.size(); ++a) out[a * stride] = static_cast<T>(s[a]);
  }

  Recent recent_;
  double tolerance_;
  double mean_norm_ = 0.0;  // bound of |mean|_H / sigma over the hypotheses, interpolation_box.hpp
  HypothesisPanels<T> p_;
  InterpolationBox box_;
  std::vector<T> prior_;          // what p_.prior is
  std::vector<int> open_fields_;  // of the open slice's measurements
  std::vector<double> exact_features_, second_features_;
  Places labelled_, second_places_, labelled_nodes_;  // places with the number of a field
  // Of readings weighed together: [reading] and [reading a][reading b], each panels x places x
  // kPanel; the lower triangle, in the end the covariances.
  std::size_t pair_size_ = 0;
  std::vector<T> pair_mean_, pair_variance_;
  std::vector<T> node_mean_, node_variance_, coefficients_;
  std::vector<T> memory_;
  std::vector<T> scratch_, features_, residual_, place_, moments_;
  std::vector<T> path_features_, path_place_;
  std::vector<T> log_densities_;
  int count_ = 0;
};

}  // namespace

void extend_by_open_rows(const SupportBasis& basis, const std::vector<const OnlineSparseGp*>& maps,
                         PathPanels& panels) {
  Places places(basis.place_dimensions(), maps.size());
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
                                             Recent recent, Precision precision,
                                             double interpolation_tolerance) {
  if (precision == Precision::single_precision) {
    return std::make_unique<Panels<float>>(basis, paths, slice_size, recent,
                                           interpolation_tolerance);
  }
  return std::make_unique<Panels<double>>(basis, paths, slice_size, recent,
                                          interpolation_tolerance);
}

}  // namespace gp_localize
