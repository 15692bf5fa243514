// Trajectories against dense Gaussian regression: exact where they promise to be.
#include <gtest/gtest.h>

#include "dense_reference.hpp"
#include "small_worlds.hpp"
#include "suffix_process.hpp"

using namespace gmrf_slap;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// Regression on rows with residuals, for one theta.
struct DenseRegression {
  MatrixXd sigma, a;  // prior; rows
  VectorXd r;
  double noise;

  MatrixXd s() const {
    return a * sigma * a.transpose() + noise * MatrixXd::Identity(r.size(), r.size());
  }
  VectorXd mean() const { return sigma * a.transpose() * s().ldlt().solve(r); }
  MatrixXd covariance() const {
    return sigma - sigma * a.transpose() * s().ldlt().solve(a * sigma);
  }
  double log_evidence() const {
    const Eigen::LDLT<MatrixXd> f(s());
    return -0.5 * (r.dot(f.solve(r)) + f.vectorD().array().log().sum() +
                   static_cast<double>(r.size()) * std::log(2.0 * M_PI));
  }
};

DenseRegression regression(const Lattice& lattice, const HyperparameterParams& h,
                           const std::vector<SiteRow>& rows, const VectorXd& r, double noise) {
  DenseRegression d;
  d.sigma = MatrixXd(prior_precision(lattice, {h.kappa, h.alpha, 2})).inverse();
  d.a.resize(static_cast<Eigen::Index>(rows.size()), lattice.sites());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    d.a.row(static_cast<Eigen::Index>(i)) = test::dense_row(rows[i], lattice.sites()).transpose();
  }
  d.r = r;
  d.noise = noise;
  return d;
}

TEST(SuffixProcess, IsDenseRegressionAlongTheTrajectory) {
  const auto params = test::small_world(6, 5, {test::theta(1.0, 0.2), test::theta(0.3, 1.0)});
  const FieldBank bank(params);
  const FieldMixture& field = bank.fields()[0];
  field_core::Random random(3);
  SuffixProcess process(12, 2);
  std::vector<SiteRow> rows;
  VectorXd r(12);
  const auto check = [&](int first, int count) {
    const std::vector<SiteRow> used(rows.begin() + first, rows.begin() + first + count);
    const SiteRow query = bank.row({random.uniform(0.0, 5.0), random.uniform(0.0, 4.0)});
    const VectorXd q = test::dense_row(query, 30);
    for (int l = 0; l < 2; ++l) {
      const auto dense =
          regression(bank.lattice(), params.hyperparameters[static_cast<std::size_t>(l)], used,
                     r.segment(first, count), 0.04);
      const auto p = process.predict(l, field, query);
      EXPECT_NEAR(p.mean, q.dot(dense.mean()), 1e-10);
      EXPECT_NEAR(p.variance, q.dot(dense.covariance() * q), 1e-10);
      EXPECT_NEAR(process.evidence(l), dense.log_evidence(), 1e-9);
      VectorXd weights = VectorXd::Zero(30);
      process.add_site_weights(l, 2.0, weights);
      EXPECT_LT((dense.sigma * weights - 2.0 * dense.mean()).norm(), 1e-9);
    }
  };
  for (int i = 0; i < 12; ++i) {
    rows.push_back(bank.row({random.uniform(0.0, 5.0), random.uniform(0.0, 4.0)}));
    r[i] = random.normal();
    for (int l = 0; l < 2; ++l) process.predict(l, field, rows.back());
    process.append(rows.back(), r[i], 0.04);
    check(0, i + 1);
  }
  process.rebuild(5, field);  // what is left above unchanged fields is a shorter stretch
  check(5, 7);
  SuffixProcess copy(12, 2);
  copy.copy_from(process);
  process.clear();
  process = copy;
  check(5, 7);
}

/// A zigzag over the grid; deltas in the robot's frame.
field_core::OdometryIncrement leg(int t) {
  return t % 4 == 3 ? test::motion(0.6, 0.0, M_PI / 2.0) : test::motion(0.7, 0.0, 0.1);
}

class Lag : public ::testing::TestWithParam<int> {};

TEST_P(Lag, OneTrajectoryIsExactWhateverTheLag) {
  // One particle without noise: merging its past into the fields loses nothing.
  auto params = test::small_world(7, 6, {test::theta(1.0, 0.2, 2.0), test::theta(0.2, 0.8)});
  params.fields["b"].mean = 5.0;
  params.fields["b"].trend = {0.3, -0.2};
  params.fields["b"].nugget_stddev = 0.2;
  params.particles = 1;
  params.lag = GetParam();
  params.initial_pose_x = 2.0;
  params.initial_pose_y = 1.0;
  Slap slap(params, 1);
  field_core::Random random(9);
  field_core::SE2 pose(2.0, 1.0, 0.0);
  std::vector<std::vector<SiteRow>> rows(2);
  std::vector<std::vector<double>> residuals(2);
  for (int t = 0; t < 23; ++t) {
    if (t > 0) {
      slap.predict(0, leg(t));
      pose = pose * leg(t).delta;
    }
    std::vector<field_core::Reading> readings;
    for (int f = 0; f < 2; ++f) {
      if (t % 3 == 1 && f == 1) continue;  // fields may be missing
      const double value = random.normal();
      const Eigen::Vector2d x = pose.translation();
      readings.push_back({f, value + (f == 1 ? 5.0 : 0.0), 0.0});
      residuals[static_cast<std::size_t>(f)].push_back(value -
                                                       (f == 1 ? 0.3 * x.x() - 0.2 * x.y() : 0.0));
      rows[static_cast<std::size_t>(f)].push_back(slap.bank().row(x));
    }
    ASSERT_TRUE(slap.update(0, test::sample_of(readings)).applied);
  }
  Eigen::Matrix2Xd points(2, 40);
  for (Eigen::Index i = 0; i < 40; ++i) points.col(i) << random.uniform(0, 6), random.uniform(0, 5);
  const auto prediction = slap.predict_field(points);
  const auto posterior = slap.hyperparameters();
  for (int f = 0; f < 2; ++f) {
    const auto ff = static_cast<std::size_t>(f);
    const VectorXd r =
        Eigen::Map<VectorXd>(residuals[ff].data(), static_cast<Eigen::Index>(residuals[ff].size()));
    std::vector<DenseRegression> dense;
    VectorXd theta(2);
    for (int l = 0; l < 2; ++l) {
      dense.push_back(regression(slap.bank().lattice(),
                                 params.hyperparameters[static_cast<std::size_t>(l)], rows[ff], r,
                                 0.09 + (f == 1 ? 0.04 : 0.0)));
      theta[l] = std::log(l == 0 ? 2.0 : 1.0) + dense.back().log_evidence();
    }
    theta = (theta.array() - theta.maxCoeff()).exp();
    theta /= theta.sum();
    EXPECT_LT((posterior[ff].probability - theta).cwiseAbs().maxCoeff(), 1e-8);
    for (Eigen::Index i = 0; i < 40; ++i) {
      const VectorXd q = test::dense_row(slap.bank().row(points.col(i)), 42);
      double first = 0.0, second = 0.0;
      for (int l = 0; l < 2; ++l) {
        const auto& d = dense[static_cast<std::size_t>(l)];
        const double m = q.dot(d.mean());
        first += theta[l] * m;
        second += theta[l] * (q.dot(d.covariance() * q) + m * m);
      }
      const double prior = f == 1 ? 5.0 + 0.3 * points(0, i) - 0.2 * points(1, i) : 0.0;
      const double noise = 0.09 + (f == 1 ? 0.04 : 0.0);
      EXPECT_NEAR(prediction.mean(f, i), prior + first, 1e-8);
      EXPECT_NEAR(prediction.variance(f, i), second - first * first + noise, 1e-8);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Lags, Lag, ::testing::Values(1, 2, 5, 8, 100));

TEST(TrajectoryBelief, WeightsAreTheExactEvidenceOfEachTrajectory) {
  auto params = test::small_world(8, 8, {test::theta(1.0, 0.2), test::theta(0.2, 0.8)});
  params.particles = 40;
  params.lag = 100;
  params.resample_threshold = 0.0;
  params.initial_pose_x = 3.0;
  params.initial_pose_y = 3.0;
  params.initial_cov_xx = params.initial_cov_yy = 1.0;
  params.initial_cov_aa = 0.1;
  Slap slap(params, 4);
  std::vector<field_core::SE2> starts;
  for (const auto& p : slap.belief(0).particles) starts.push_back(p.pose);
  ASSERT_EQ(starts.size(), 40u);
  field_core::Random random(8);
  std::vector<std::vector<SiteRow>> rows(40);
  std::vector<field_core::SE2> poses = starts;
  VectorXd values(9);
  for (int t = 0; t < 9; ++t) {
    if (t > 0) slap.predict(0, leg(t));
    values[t] = random.normal();
    for (std::size_t p = 0; p < 40; ++p) {
      if (t > 0) poses[p] = poses[p] * leg(t).delta;
      rows[p].push_back(slap.bank().row(poses[p].translation()));
    }
    slap.update(0, test::sample_of({{0, values[t], 0.0}}));
  }
  VectorXd expected(40);
  for (std::size_t p = 0; p < 40; ++p) {
    double evidence = 0.0;
    for (int l = 0; l < 2; ++l) {
      // Outside of the grid a row is empty: variance of a site, correlated with nothing.
      DenseRegression d =
          regression(slap.bank().lattice(), params.hyperparameters[static_cast<std::size_t>(l)],
                     rows[p], values, 0.09);
      MatrixXd s = d.s();
      for (Eigen::Index i = 0; i < 9; ++i) {
        if (rows[p][static_cast<std::size_t>(i)].count == 0) s(i, i) += d.sigma(0, 0);
      }
      evidence +=
          0.5 * std::exp(-0.5 * values.dot(s.ldlt().solve(values))) / std::sqrt(s.determinant());
    }
    expected[static_cast<Eigen::Index>(p)] = evidence;
  }
  expected /= expected.sum();
  const auto belief = slap.belief(0);
  for (std::size_t p = 0; p < 40; ++p) {
    EXPECT_NEAR(belief.particles[p].weight, expected[static_cast<Eigen::Index>(p)], 1e-9);
    EXPECT_LT((belief.particles[p].pose.vector() - poses[p].vector()).norm(), 1e-12);
  }
  EXPECT_GT(expected.maxCoeff(), 0.06);  // the weights differ, or nothing was tested
}

}  // namespace
