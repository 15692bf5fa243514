// Moment matching as one symmetric product against the paper's equations component by component.
#include <gtest/gtest.h>

#include "dense_reference.hpp"
#include "gmrf_slap/field_prior.hpp"
#include "gmrf_slap/gaussian_field.hpp"
#include "symmetric_kernels.hpp"

using namespace gmrf_slap;
using test::DenseGaussian;

namespace {

struct Places {
  std::vector<SiteRow> rows;
  std::vector<double> weights;
};

Places random_places(const Lattice& lattice, int count, Interpolation interpolation,
                     field_core::Random& random) {
  Places places;
  double sum = 0.0;
  for (int k = 0; k < count; ++k) {
    places.rows.push_back(lattice.row(
        {random.uniform(0.0, lattice.nx() - 1.0), random.uniform(0.0, lattice.ny() - 1.0)},
        interpolation));
    places.weights.push_back(random.uniform());
    sum += places.weights.back();
  }
  for (double& w : places.weights) w /= sum;
  return places;
}

void condition_both(GaussianField& field, DenseGaussian& dense, const Places& places, double z,
                    double noise) {
  const int n = field.sites(), count = static_cast<int>(places.rows.size());
  std::vector<double> mean(places.rows.size()), variance(mean);
  field.predict(places.rows.data(), count, mean.data(), variance.data());
  MixtureUpdate update;
  update.clear(count);
  std::vector<DenseGaussian> components;
  for (std::size_t k = 0; k < places.rows.size(); ++k) {
    update.add(places.rows[k], places.weights[k], z - mean[k], variance[k] + noise);
    components.push_back(test::condition_on(dense, test::dense_row(places.rows[k], n), z, noise));
  }
  field.condition(update);
  dense = test::moments(components, places.weights);
}

void expect_equal(const GaussianField& field, const DenseGaussian& dense, double tolerance) {
  const int n = field.sites();
  EXPECT_LT((field.mean() - dense.mean).cwiseAbs().maxCoeff(), tolerance);
  EXPECT_LT((field.variances() - dense.sigma.diagonal()).cwiseAbs().maxCoeff(), tolerance);
  std::vector<SiteRow> sites;
  for (int s = 0; s < n; ++s) sites.push_back({1, {s}, {1.0}});
  Eigen::VectorXd column(n);
  for (int s = 0; s < n; s += 7) {
    field.covariances(sites[static_cast<std::size_t>(s)], sites.data(), n, column.data());
    EXPECT_LT((column - dense.sigma.col(s)).cwiseAbs().maxCoeff(), tolerance);
  }
}

class DenseField : public ::testing::TestWithParam<Interpolation> {};

TEST_P(DenseField, EqualsComponentByComponent) {
  // 143 sites: no multiple of a panel or a tile. Prior variance near 1, so 1e-9 is nine digits.
  const Lattice lattice({0.0, 0.0}, 1.0, 13, 11, false);
  const auto q = prior_precision(lattice, {0.8, 0.1, 2});
  auto field = make_dense_field(q);
  DenseGaussian dense{Eigen::VectorXd::Zero(143), Eigen::MatrixXd(q).inverse()};
  field_core::Random random(5);
  for (const int count : {1, 2, 9, 40, 1, 120}) {
    const Places places = random_places(lattice, count, GetParam(), random);
    condition_both(*field, dense, places, random.normal(0.0, 2.0), 0.01);
    expect_equal(*field, dense, 1e-9);
  }
  EXPECT_LT(field->variances().mean(), 0.9 * Eigen::MatrixXd(q).inverse().diagonal().mean());
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(dense.sigma).eigenvalues()[0], 0.0);
}

TEST_P(DenseField, StateBringsBackTheSameBits) {
  const Lattice lattice({0.0, 0.0}, 1.0, 8, 5, false);
  const auto q = prior_precision(lattice, {1.0, 0.2, 2});
  auto a = make_dense_field(q), b = make_dense_field(q);
  DenseGaussian dense{Eigen::VectorXd::Zero(40), Eigen::MatrixXd(q).inverse()};
  field_core::Random random(6);
  condition_both(*a, dense, random_places(lattice, 6, GetParam(), random), 1.0, 0.1);
  field_core::State state("test", 1);
  a->save(state, "f/");
  b->restore(state, "f/");
  const auto c = b->clone();
  const Places places = random_places(lattice, 6, GetParam(), random);
  DenseGaussian ignored = dense;
  condition_both(*a, dense, places, -1.0, 0.1);
  condition_both(*c, ignored, places, -1.0, 0.1);
  EXPECT_EQ(a->mean(), c->mean());
  EXPECT_EQ(a->variances(), c->variances());
}

INSTANTIATE_TEST_SUITE_P(Rows, DenseField,
                         ::testing::Values(Interpolation::nearest, Interpolation::bilinear));

TEST(SymmetricKernels, VersionsAgreeWithPlainLoops) {
  field_core::Random random(7);
  for (const VectorWidth width : {VectorWidth::narrow, VectorWidth::avx2, VectorWidth::avx512}) {
    use_vector_width(width);
    for (const int n : {1, 7, 24, 25, 96, 101, 143}) {
      for (const int columns : {1, 3, 50}) {
        Eigen::MatrixXd c =
            Eigen::MatrixXd::NullaryExpr(n, columns, [&] { return random.normal(); });
        Eigen::VectorXd d = Eigen::VectorXd::NullaryExpr(columns, [&] { return random.normal(); });
        Eigen::MatrixXd sigma = Eigen::MatrixXd::NullaryExpr(n, n, [&] { return random.normal(); });
        std::vector<double> panels(static_cast<std::size_t>(panel_count(n) * kPanelRows * columns),
                                   0.0);
        for (int i = 0; i < n; ++i) {
          for (int k = 0; k < columns; ++k) {
            panels[static_cast<std::size_t>((i / kPanelRows) * columns * kPanelRows +
                                            k * kPanelRows + i % kPanelRows)] = c(i, k);
          }
        }
        std::vector<double> scratch(downdate_scratch(n, columns));
        Eigen::MatrixXd expected = sigma;
        const Eigen::MatrixXd product = c * d.asDiagonal() * c.transpose();
        expected.triangularView<Eigen::Lower>() -= product;
        symmetric_downdate(n, sigma.data(), columns, panels.data(), d.data(), scratch.data());
        // 50 products of normals: sums near 7, rounding near 1e-15 each.
        EXPECT_LT((sigma - expected).cwiseAbs().maxCoeff(), 1e-12) << n << " x " << columns;
      }
    }
  }
  use_vector_width(VectorWidth::avx512);
}

}  // namespace
