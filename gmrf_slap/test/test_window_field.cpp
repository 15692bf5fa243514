// The sparse engine equals the dense one; the local engine's error is what it is said to be.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "dense_reference.hpp"
#include "field_core/errors.hpp"
#include "gmrf_slap/field_prior.hpp"
#include "gmrf_slap/gaussian_field.hpp"

using namespace gmrf_slap;
using Eigen::Vector2d;
using Eigen::VectorXd;

namespace {

std::vector<int> sites_of(const std::vector<SiteRow>& rows) {
  std::vector<int> sites;
  for (const SiteRow& row : rows) {
    sites.insert(sites.end(), row.site.begin(), row.site.begin() + row.count);
  }
  return sites;
}

/// `count` places within 1.5 m of a robot that crosses the lattice, with one measurement.
struct Places {
  std::vector<SiteRow> rows;
  std::vector<double> weights;
  double z;
};

Places places_at(const Lattice& lattice, int step, int count, field_core::Random& random) {
  const Vector2d robot(2.0 + std::fmod(1.3 * step, lattice.nx() - 5.0),
                       2.0 + std::fmod(0.7 * step, lattice.ny() - 5.0));
  Places out;
  double sum = 0.0;
  for (int k = 0; k < count; ++k) {
    const Vector2d d(random.uniform(-1.5, 1.5), random.uniform(-1.5, 1.5));
    out.rows.push_back(
        lattice.row(robot + d, k % 3 ? Interpolation::bilinear : Interpolation::nearest));
    out.weights.push_back(random.uniform());
    sum += out.weights.back();
  }
  for (double& w : out.weights) w /= sum;
  out.z = random.normal();
  return out;
}

void condition(GaussianField& field, const Places& places) {
  field.focus(sites_of(places.rows), sites_of(places.rows));
  const int count = static_cast<int>(places.rows.size());
  std::vector<double> mean(places.rows.size()), variance(mean);
  field.predict(places.rows.data(), count, mean.data(), variance.data());
  MixtureUpdate update;
  update.clear(count);
  for (std::size_t k = 0; k < places.rows.size(); ++k) {
    update.add(places.rows[k], places.weights[k], places.z - mean[k], variance[k] + 0.05);
  }
  field.condition(update);
}

struct Difference {
  double mean, variance;  ///< largest, the variance relative
};

Difference difference(const GaussianField& a, const GaussianField& b) {
  return {(a.mean() - b.mean()).cwiseAbs().maxCoeff(),
          ((a.variances() - b.variances()).array() / b.variances().array()).abs().maxCoeff()};
}

class Engines : public ::testing::TestWithParam<bool> {};

TEST_P(Engines, SparseEqualsDense) {
  const Lattice lattice({0.0, 0.0}, 1.0, 19, 14, GetParam());
  for (const Theta theta : {Theta{1.0, 0.1, 2}, Theta{0.5, 1.0, 1}}) {
    const auto q = prior_precision(lattice, theta);
    auto dense = make_dense_field(q);
    WindowSettings settings;
    settings.margin = 2;
    if (theta.order == 2) settings.grow_up_to = lattice.sites();
    auto sparse = make_window_field(lattice, q, settings);
    field_core::Random random(11);
    for (int t = 0; t < 40; ++t) {
      const Places places = places_at(lattice, t, t % 4 == 0 ? 1 : 12, random);
      condition(*dense, places);
      condition(*sparse, places);
      const SiteRow query = places.rows[0];
      VectorXd a(places.rows.size()), b(places.rows.size());
      dense->covariances(query, places.rows.data(), static_cast<int>(a.size()), a.data());
      sparse->covariances(query, places.rows.data(), static_cast<int>(b.size()), b.data());
      EXPECT_LT((a - b).cwiseAbs().maxCoeff(), 1e-8);
      if (t % 8 != 7) continue;
      const Difference d = difference(*sparse, *dense);
      EXPECT_LT(d.mean, 1e-8) << t;
      EXPECT_LT(d.variance, 1e-8) << t;
      std::vector<SiteRow> rows;
      for (int k = 0; k < 30; ++k) {
        rows.push_back(lattice.row({random.uniform(0.0, 18.0), random.uniform(0.0, 13.0)},
                                   Interpolation::bilinear));
      }
      VectorXd m(30), v(30), n(30), w(30);
      dense->survey(rows.data(), 30, m.data(), v.data());
      sparse->survey(rows.data(), 30, n.data(), w.data());
      EXPECT_LT((m - n).cwiseAbs().maxCoeff(), 1e-8);
      EXPECT_LT((v - w).cwiseAbs().maxCoeff(), 1e-8);
      const VectorXd x = VectorXd::LinSpaced(lattice.sites(), -1.0, 1.0);
      EXPECT_LT((dense->multiply(x) - sparse->multiply(x)).cwiseAbs().maxCoeff(), 1e-7);
    }
    EXPECT_LT(dense->variances().minCoeff(), 0.5 * dense->variances().maxCoeff());
  }
}

TEST_P(Engines, StateContinuesBitForBit) {
  const Lattice lattice({0.0, 0.0}, 1.0, 15, 12, GetParam());
  const auto q = prior_precision(lattice, {1.0, 0.2, 2});
  WindowSettings settings;
  settings.margin = 2;
  auto a = make_window_field(lattice, q, settings), b = make_window_field(lattice, q, settings);
  field_core::Random random(12);
  for (int t = 0; t < 9; ++t) condition(*a, places_at(lattice, t, 6, random));
  field_core::State state("test", 1);
  a->save(state, "f/");
  a->mean();  // looking changes nothing
  b->restore(state, "f/");
  for (int t = 9; t < 20; ++t) {
    const Places places = places_at(lattice, t, 6, random);
    condition(*a, places);
    condition(*b, places);
  }
  EXPECT_EQ(a->mean(), b->mean());
  EXPECT_EQ(a->variances(), b->variances());
}

TEST_P(Engines, ACopyGoesItsOwnWay) {
  const Lattice lattice({0.0, 0.0}, 1.0, 15, 12, GetParam());
  WindowSettings settings;
  settings.margin = 2;
  auto a = make_window_field(lattice, prior_precision(lattice, {1.0, 0.2, 2}), settings);
  field_core::Random random(12);
  for (int t = 0; t < 5; ++t) condition(*a, places_at(lattice, t, 6, random));
  const auto untouched = a->clone(), copy = a->clone();
  for (int t = 5; t < 12; ++t) condition(*copy, places_at(lattice, t, 6, random));
  EXPECT_GT((copy->mean() - a->mean()).cwiseAbs().maxCoeff(), 0.01);
  EXPECT_EQ(a->mean(), untouched->mean());
  EXPECT_EQ(a->variances(), untouched->variances());
}

INSTANTIATE_TEST_SUITE_P(Shapes, Engines, ::testing::Bool());

/// Mean and relative variance error of the local engine, averaged over sites, after a drive.
Difference local_error(int halo) {
  const Lattice lattice({0.0, 0.0}, 1.0, 40, 40, false);
  const auto q = prior_precision(lattice, {1.0, 0.2, 2});  // bandwidth 3.2 sites
  auto dense = make_dense_field(q);
  WindowSettings settings;
  settings.halo = halo;
  settings.margin = 2;
  auto local = make_window_field(lattice, q, settings);
  field_core::Random random(13);
  Difference worst{0.0, 0.0};
  for (int t = 0; t < 60; ++t) {
    const Places places = places_at(lattice, t, 8, random);
    condition(*dense, places);
    condition(*local, places);
    // Where the robot is: what the filter uses.
    VectorXd m(8), v(8), n(8), w(8);
    dense->predict(places.rows.data(), 8, m.data(), v.data());
    local->predict(places.rows.data(), 8, n.data(), w.data());
    worst.mean = std::max(worst.mean, (m - n).cwiseAbs().maxCoeff() / std::sqrt(v.maxCoeff()));
    worst.variance = std::max(worst.variance, ((v - w).array() / v.array()).abs().maxCoeff());
  }
  return worst;
}

TEST(LocalEngine, ErrorFallsWithTheHalo) {
  std::vector<Difference> errors;
  for (const int halo : {4, 8, 12, 16}) {
    errors.push_back(local_error(halo));
  }
  for (std::size_t i = 1; i < errors.size(); ++i) {
    EXPECT_LT(errors[i].variance, errors[i - 1].variance);
    EXPECT_LT(errors[i].mean, errors[i - 1].mean);
  }
  // Measured: 0.05 sd and 2 % for 2.5 bandwidths, 0.01 sd and 0.2 % for 3.75.
  EXPECT_LT(errors[1].mean, 0.1);
  EXPECT_LT(errors[1].variance, 0.05);
  EXPECT_LT(errors[2].mean, 0.03);
  EXPECT_LT(errors[2].variance, 0.01);
  EXPECT_GT(errors[3].variance, 1e-9);  // an approximation all the same
}

TEST(WindowField, ReachesAheadOfTheRobotOnly) {
  const Lattice lattice({0.0, 0.0}, 1.0, 40, 40, false);
  const auto q = prior_precision(lattice, {1.0, 0.2, 2});
  WindowSettings settings;
  settings.margin = 3;
  auto field = make_window_field(lattice, q, settings);
  const int robot = lattice.site(30, 20), past = lattice.site(10, 20);
  EXPECT_TRUE(field->focus({past, robot}, {robot}));
  EXPECT_FALSE(field->focus({past, lattice.site(33, 17)}, {robot}));
  EXPECT_TRUE(field->focus({lattice.site(11, 20)}, {robot}));
  EXPECT_TRUE(field->focus({past, robot}, {robot}));
  // Covariances of both are those of the whole field.
  const auto dense = make_dense_field(q);
  const std::vector<SiteRow> rows = {{1, {past}, {1.0}}, {1, {robot}, {1.0}}};
  VectorXd a(2), b(2);
  field->covariances(rows[0], rows.data(), 2, a.data());
  dense->covariances(rows[0], rows.data(), 2, b.data());
  EXPECT_LT((a - b).cwiseAbs().maxCoeff(), 1e-10);
}

/// Whether a robot that comes back finds the window that it had, on a grid of `side` squared.
bool keeps_the_window(int side, int grow_up_to) {
  const Lattice lattice({0.0, 0.0}, 1.0, side, side, false);
  WindowSettings settings;
  settings.margin = 3;  // 49 sites around each of two places far apart
  settings.grow_up_to = grow_up_to;
  auto field = make_window_field(lattice, prior_precision(lattice, {1.0, 0.2, 2}), settings);
  const int here = lattice.site(5, 5), there = lattice.site(15, 5);
  field->focus({here}, {here});
  field->focus({there}, {there});
  return !field->focus({here}, {here});
}

TEST(WindowField, OnlyGrowsOnSmallGrids) {
  EXPECT_TRUE(keeps_the_window(20, 400));
  EXPECT_FALSE(keeps_the_window(20, 399));
  EXPECT_FALSE(keeps_the_window(40, 400));
}

TEST(WindowField, RefusesAStateThatKeptWhatItLearnedApart) {
  const Lattice lattice({0.0, 0.0}, 1.0, 9, 9, false);
  auto field = make_window_field(lattice, prior_precision(lattice, {1.0, 0.2, 2}), {});
  field_core::State state("test", 1);
  field->save(state, "f/");
  field->restore(state, "f/");
  state.set("f/pairs", 0.0);
  EXPECT_THROW(field->restore(state, "f/"), field_core::DataError);
}

TEST(WindowField, SaysWhatIsMissing) {
  const Lattice lattice({0.0, 0.0}, 1.0, 30, 30, false);
  WindowSettings settings;
  settings.largest_window = 200;
  auto field = make_window_field(lattice, prior_precision(lattice, {1.0, 0.2, 2}), settings);
  const SiteRow row = lattice.row({3.0, 3.0}, Interpolation::nearest);
  double m = 0.0, v = 0.0;
  EXPECT_THROW(field->predict(&row, 1, &m, &v), field_core::NumericalError);
  std::vector<int> everywhere;
  for (int s = 0; s < 900; ++s) everywhere.push_back(s);
  try {
    field->focus(everywhere, everywhere);
    FAIL();
  } catch (const field_core::NumericalError& e) {
    EXPECT_NE(std::string(e.what()).find("shorten lag"), std::string::npos);
  }
}

}  // namespace
