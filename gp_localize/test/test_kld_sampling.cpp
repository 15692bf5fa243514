#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "gp_localize/kld_sampling.hpp"

using namespace gp_localize;
using field_core::SE2;

namespace {

// Fox (2003), eq. 7 approximates chi-squared quantiles: those below are from tables, 99 %.
TEST(KldSampling, BoundIsTheQuantileOfChiSquared) {
  const double error = 0.05;
  EXPECT_NEAR(kld_bound(11, error, 2.326), 23.209 / (2 * error), 0.005 * 232);
  EXPECT_NEAR(kld_bound(51, error, 2.326), 76.154 / (2 * error), 0.002 * 761);
  EXPECT_EQ(kld_bound(1, error, 2.326), 1.0);
}

TEST(KldSampling, BinsAreCountedOnce) {
  PoseBins bins(100);
  EXPECT_TRUE(bins.insert(SE2(0.1, 0.1, 0.01)));
  EXPECT_FALSE(bins.insert(SE2(0.4, 0.3, 0.15)));
  EXPECT_TRUE(bins.insert(SE2(0.6, 0.1, 0.01)));
  EXPECT_TRUE(bins.insert(SE2(-0.1, 0.1, 0.01)));
  EXPECT_TRUE(bins.insert(SE2(0.1, 0.1, -0.01)));
  EXPECT_EQ(bins.count(), 4);
  bins.clear();
  EXPECT_TRUE(bins.insert(SE2(0.1, 0.1, 0.01)));
  PoseBins full(400);
  for (int i = 0; i < 400; ++i) EXPECT_TRUE(full.insert(SE2(0.25 + 0.5 * (i % 20), i / 20, 0.1)));
  for (int i = 0; i < 400; ++i) EXPECT_FALSE(full.insert(SE2(0.25 + 0.5 * (i % 20), i / 20, 0.1)));
}

struct Drawn {
  std::vector<int> ancestors;
  explicit Drawn(double spread, int most = 5000) {
    field_core::Random random(4);
    std::vector<SE2> poses;
    std::vector<double> weights;
    for (int i = 0; i < 1000; ++i) {
      poses.emplace_back(0.25 + spread * random.normal(), 0.25 + spread * random.normal(), 0.1);
      weights.push_back(i < 500 ? 0.0005 : 0.0015);
    }
    PoseBins bins(most);
    std::vector<double> cumulative;
    kld_resample(weights, poses, {100, most, 0.05, 2.33}, bins, random, cumulative, ancestors);
  }
};

TEST(KldSampling, WiderBeliefsGetMoreParticles) {
  EXPECT_EQ(Drawn(0.01).ancestors.size(), 100u);
  const std::size_t wide = Drawn(1.0).ancestors.size();
  EXPECT_GT(wide, 400u);
  EXPECT_GT(Drawn(3.0).ancestors.size(), wide);
  EXPECT_EQ(Drawn(3.0, 700).ancestors.size(), 700u);
}

TEST(KldSampling, DrawsByWeight) {
  const auto ancestors = Drawn(3.0).ancestors;
  EXPECT_TRUE(std::is_sorted(ancestors.begin(), ancestors.end()));
  const auto heavy =
      std::count_if(ancestors.begin(), ancestors.end(), [](int a) { return a >= 500; });
  const double n = static_cast<double>(ancestors.size());
  // Three quarters of the weight; four standard errors of a binomial.
  EXPECT_NEAR(heavy / n, 0.75, 4.0 * std::sqrt(0.75 * 0.25 / n));
}

}  // namespace
