// Every observation model, as the filter uses it over several sample paths, against dense
// regression on the same paths: eq. (9) with the moments and densities of each model.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "../src/path_bank.hpp"
#include "dense_reference.hpp"
#include "field_core/errors.hpp"
#include "field_core/random.hpp"
#include "gp_localize/dense_gp.hpp"

using namespace gp_localize;
using test::block_regression;
using test::DenseField;

namespace {

constexpr int kPaths = 3, kSteps = 23, kSlice = 5, kSubset = 6, kParticles = 4;
constexpr double kLikelihoodNoise = 0.2;

using Model = ObservationModelType;

GpLocalizeParams params(Model model) {
  GpLocalizeParams p;
  FieldParams f;
  f.kernel = field_core::KernelType::matern32;
  f.signal_stddev = 1.4;
  f.noise_stddev = 0.25;
  f.length_scales = {1.5, 2.5};
  p.fields = {{"a", f}};
  p.map_hypotheses = MapHypotheses::sample_paths;
  p.sample_paths = kPaths;
  p.slice_size = kSlice;
  p.subset_size = kSubset;
  p.observation_model = model;
  p.precision = Precision::double_precision;
  p.support.region = {-5.0, -5.0, 5.0, 5.0};
  p.support.size = 16;
  p.support.jitter = 1e-6;
  return p;
}

struct Data {
  std::vector<Eigen::Matrix2Xd> paths{kPaths, Eigen::Matrix2Xd(2, kSteps)};
  Eigen::VectorXd values{kSteps};
  Eigen::Matrix2Xd particles{2, kParticles};
  Data() {
    field_core::Random random(9);
    for (int t = 0; t < kSteps; ++t) {
      values[t] = std::sin(0.4 * t) + 0.2 * random.normal();
      for (auto& path : paths) {
        path.col(t) << 4 * std::cos(0.3 * t) + 0.4 * random.normal(),
            4 * std::sin(0.2 * t) + 0.4 * random.normal();
      }
    }
    for (int p = 0; p < kParticles; ++p) particles.col(p) << 2.0 * p - 3.0, 3.0 - p;
  }
};

/// What the model should say at `query` after the first n measurements of a path.
test::Moments expected(Model model, const DenseField& f, const Eigen::Matrix2Xd& x,
                       const Eigen::VectorXd& z, int n, const Eigen::Vector2d& query) {
  std::vector<int> blocks(n), use(n);
  for (int i = 0; i < n; ++i) use[i] = i;
  const auto regression = [&](int query_block) {
    Eigen::Matrix2Xd xs(2, use.size());
    Eigen::VectorXd zs(use.size());
    std::vector<int> bs(use.size());
    for (std::size_t i = 0; i < use.size(); ++i) {
      xs.col(i) = x.col(use[i]);
      zs[i] = z[use[i]];
      bs[i] = blocks[use[i]];
    }
    return block_regression(f, xs, zs, bs, query, query_block);
  };
  switch (model) {
    case Model::full_gp:  // one block: nothing is approximated
      return regression(0);
    case Model::sod_truncate:
      if (n > kSubset) use.erase(use.begin(), use.end() - kSubset);
      return regression(0);
    case Model::sod_even:
      if (n > kSubset) {
        use.clear();
        for (int i = 0; i < kSubset; ++i) use.push_back(std::lround(i * (n - 1) / 5.0));
      }
      return regression(0);
    case Model::fitc:
      for (int i = 0; i < n; ++i) blocks[i] = i;
      return regression(-1);
    case Model::offline_pitc:
      for (int i = 0; i < n; ++i) blocks[i] = i / kSlice;
      return regression(-1);
    case Model::online_pitc:
      for (int i = 0; i < n; ++i) blocks[i] = i / kSlice;
      return regression(n % kSlice ? n / kSlice : -1);
    case Model::online_pitc_assimilated:
      for (int i = 0; i < n; ++i) blocks[i] = i / kSlice;
      use.resize(n / kSlice * kSlice);
      return regression(-1);
  }
  throw std::logic_error("no such model");
}

class ObservationModels : public ::testing::TestWithParam<Model> {};

TEST_P(ObservationModels, EqualDenseRegressionOnEveryPath) {
  const GpLocalizeParams p = params(GetParam());
  const auto fields = make_field_models(p);
  const auto& basis = fields[0].basis;
  const DenseField dense{basis.kernel(), basis.support(), 1e-6 * basis.kernel().signal_variance(),
                         fields[0].noise_variance};
  const auto bank = make_path_bank(p, fields[0]);
  bank->restart();
  const Data data;
  for (int n = 0; n < kSteps; ++n) {
    Eigen::Matrix2Xd moments;
    std::vector<double> log_likelihood;
    bank->begin(kParticles);
    bank->add(data.particles, data.values[n], kLikelihoodNoise, *bank, moments);
    bank->log_mean(log_likelihood);
    for (int q = 0; q < kParticles; ++q) {
      double density = 0.0, mean = 0.0, square = 0.0;
      for (int c = 0; c < kPaths; ++c) {
        const auto m =
            expected(GetParam(), dense, data.paths[c], data.values, n, data.particles.col(q));
        const double v = m.variance + kLikelihoodNoise, e = data.values[n] - m.mean;
        density += std::exp(-0.5 * e * e / v) / std::sqrt(v) / kPaths;
        mean += m.mean / kPaths;
        square += (v + m.mean * m.mean) / kPaths;
      }
      // Rounding times the condition 1e6 of the support covariance.
      ASSERT_NEAR(moments(0, q), mean, 1e-9) << "after " << n;
      ASSERT_NEAR(moments(1, q), square, 1e-9) << "after " << n;
      ASSERT_NEAR(log_likelihood[q], std::log(density), 1e-9) << "after " << n;
    }
    Eigen::Matrix2Xd own(2, kPaths);
    for (int c = 0; c < kPaths; ++c) own.col(c) = data.paths[c].col(n);
    bank->learn(own, data.values[n], fields[0].noise_variance);
    if ((n + 1) % kSlice == 0) bank->close_slice();
  }
}

TEST_P(ObservationModels, RestoreWhatTheySave) {
  const GpLocalizeParams p = params(GetParam());
  const auto fields = make_field_models(p);
  const auto original = make_path_bank(p, fields[0]), copy = make_path_bank(p, fields[0]);
  original->restart();
  copy->restart();
  const Data data;
  for (int n = 0; n < 13; ++n) {
    Eigen::Matrix2Xd own(2, kPaths);
    for (int c = 0; c < kPaths; ++c) own.col(c) = data.paths[c].col(n);
    original->learn(own, data.values[n], 0.04);
    if ((n + 1) % kSlice == 0) original->close_slice();
  }
  field_core::State state("gp_localize", 1);
  original->save(state);
  copy->check(state);
  copy->restore(state);
  Eigen::Matrix2Xd a, b;
  original->predict(data.particles, a);
  copy->predict(data.particles, b);
  EXPECT_EQ(a, b);
  EXPECT_THROW(copy->check(field_core::State("gp_localize", 1)), field_core::DataError);
}

INSTANTIATE_TEST_SUITE_P(All, ObservationModels,
                         ::testing::Values(Model::full_gp, Model::offline_pitc, Model::fitc,
                                           Model::online_pitc, Model::online_pitc_assimilated,
                                           Model::sod_truncate, Model::sod_even));

// Several fields: densities multiply per path before the mean is taken (a path is one hypothesis
// for all fields), which is not the product of the fields' means.
TEST(ObservationModelsTest, FieldsMultiplyPerPath) {
  GpLocalizeParams p = params(Model::online_pitc);
  p.fields["b"] = p.fields["a"];
  p.fields["b"].length_scales = {2.0, 2.0};
  const auto fields = make_field_models(p);
  const Data data;
  for (const Precision precision : {Precision::double_precision, Precision::single_precision}) {
    p.precision = precision;
    const auto a = make_path_bank(p, fields[0]), b = make_path_bank(p, fields[1]);
    std::vector<double> joint, of_a, of_b;
    Eigen::Matrix2Xd own(2, kPaths), moments;
    for (const auto* bank : {&a, &b}) {
      (*bank)->restart();
      for (int n = 0; n < 8; ++n) {
        for (int c = 0; c < kPaths; ++c) own.col(c) = data.paths[c].col(n);
        (*bank)->learn(own, (bank == &a ? 1.0 : -1.0) * data.values[n], 0.06);
        if (n == 4) (*bank)->close_slice();
      }
    }
    a->begin(kParticles);
    a->add(data.particles, 0.3, kLikelihoodNoise, *a, moments);
    b->add(data.particles, -0.8, kLikelihoodNoise, *a, moments);
    a->log_mean(joint);
    const DenseField dense_a{fields[0].basis.kernel(), fields[0].basis.support(), 1e-6 * 1.96,
                             0.06};
    const DenseField dense_b{fields[1].basis.kernel(), fields[1].basis.support(), 1e-6 * 1.96,
                             0.06};
    for (int q = 0; q < kParticles; ++q) {
      double density = 0.0;
      for (int c = 0; c < kPaths; ++c) {
        const Eigen::Vector2d x = data.particles.col(q);
        const auto ma = expected(Model::online_pitc, dense_a, data.paths[c], data.values, 8, x);
        const auto mb = expected(Model::online_pitc, dense_b, data.paths[c], -data.values, 8, x);
        const auto normal = [](double e, double v) {
          return std::exp(-0.5 * e * e / v) / std::sqrt(v);
        };
        density += normal(0.3 - ma.mean, ma.variance + kLikelihoodNoise) *
                   normal(-0.8 - mb.mean, mb.variance + kLikelihoodNoise) / kPaths;
      }
      EXPECT_NEAR(joint[q], std::log(density),
                  precision == Precision::double_precision ? 1e-9 : 1e-4);
    }
  }
}

// Particles that stand close together share evaluations, within the tolerance and not for nothing.
TEST(DensePathBank, InterpolatesBetweenParticlesThatStandClose) {
  for (const Model model : {Model::full_gp, Model::sod_even, Model::sod_truncate}) {
    GpLocalizeParams exact = params(model), shared = params(model);
    exact.fields["a"].kernel = shared.fields["a"].kernel =
        field_core::KernelType::squared_exponential;
    exact.subset_size = shared.subset_size = 20;
    exact.interpolation_tolerance = 0.0;
    shared.interpolation_tolerance = 1e-3;
    const auto fields = make_field_models(exact);
    const Data data;
    field_core::Random random(4);
    Eigen::Matrix2Xd particles(2, 400);
    for (int p = 0; p < 400; ++p) {
      particles.col(p) << 1.0 + 0.3 * random.uniform(), 2.0 + 0.3 * random.uniform();
    }
    Eigen::Matrix2Xd moments[2], own(2, kPaths);
    for (const bool interpolated : {false, true}) {
      const auto bank = make_path_bank(interpolated ? shared : exact, fields[0]);
      bank->restart();
      for (int n = 0; n < kSteps; ++n) {
        for (int c = 0; c < kPaths; ++c) own.col(c) = data.paths[c].col(n);
        bank->learn(own, data.values[n], kLikelihoodNoise);
      }
      bank->begin(400);
      bank->add(particles, 0.3, kLikelihoodNoise, *bank, moments[interpolated]);
    }
    const Eigen::Array2Xd error = (moments[1] - moments[0]).array();
    EXPECT_GT(error.abs().maxCoeff(), 1e-12);  // nodes were used
    EXPECT_LT(error.row(0).abs().maxCoeff(), 1e-3 * std::sqrt(kLikelihoodNoise));
    // Variance plus square of the mean.
    const double mean = moments[0].row(0).cwiseAbs().maxCoeff();
    EXPECT_LT(error.row(1).abs().maxCoeff(),
              1e-3 * kLikelihoodNoise + 2.1e-3 * mean * std::sqrt(kLikelihoodNoise));
  }
}

TEST(SelectSubset, TakesWhatTheNamesSay) {
  using V = std::vector<int>;
  EXPECT_EQ(select_subset(Model::full_gp, 3, 2), (V{0, 1, 2}));
  EXPECT_EQ(select_subset(Model::sod_truncate, 7, 3), (V{4, 5, 6}));
  EXPECT_EQ(select_subset(Model::sod_truncate, 2, 3), (V{0, 1}));
  EXPECT_EQ(select_subset(Model::sod_even, 9, 3), (V{0, 4, 8}));
  EXPECT_EQ(select_subset(Model::sod_even, 2, 3), (V{0, 1}));
  EXPECT_EQ(select_subset(Model::sod_even, 5, 1), (V{4}));
  EXPECT_EQ(select_subset(Model::sod_even, 0, 3), V{});
  EXPECT_THROW(select_subset(Model::fitc, 3, 2), field_core::ParameterError);
}

}  // namespace
