#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "gp_localize/resampling.hpp"

using namespace gp_localize;

TEST(Resampling, NormalizesLogWeightsOfAnySize) {
  std::vector<double> w{-5000.0, -5000.0 + std::log(3.0), -INFINITY};
  ASSERT_TRUE(normalize_log_weights(w));
  EXPECT_NEAR(w[0], 0.25, 1e-12);  // -5000 + log 3 has 13 digits of log 3
  EXPECT_NEAR(w[1], 0.75, 1e-12);
  EXPECT_EQ(w[2], 0.0);
}

TEST(Resampling, RefusesWeightsWithoutAnyEvidence) {
  std::vector<double> none{-INFINITY, -INFINITY}, nan{0.0, NAN}, empty;
  EXPECT_FALSE(normalize_log_weights(none));
  EXPECT_FALSE(normalize_log_weights(nan));
  EXPECT_FALSE(normalize_log_weights(empty));
  EXPECT_EQ(none[0], -INFINITY);
}

TEST(Resampling, EffectiveSampleSize) {
  EXPECT_NEAR(effective_sample_size({0.25, 0.25, 0.25, 0.25}), 4.0, 1e-14);
  EXPECT_NEAR(effective_sample_size({1.0, 0.0}), 1.0, 1e-14);
  EXPECT_NEAR(effective_sample_size({0.5, 0.25, 0.25}), 1.0 / 0.375, 1e-14);
}

TEST(Resampling, EachParticleGetsFloorOrCeilOfItsShare) {
  const std::vector<double> w{0.11, 0.42, 0.0, 0.06, 0.41};
  for (const double offset : {0.0, 0.3, 0.77, 0.999}) {
    for (const std::size_t count : {1, 3, 5, 12}) {  // fewer, as many and more than there were
      std::vector<int> ancestors, copies(5, 0);
      low_variance_resample(w, offset, count, ancestors);
      ASSERT_EQ(ancestors.size(), count);
      for (const int a : ancestors) ++copies[a];
      for (int i = 0; i < 5; ++i) {
        EXPECT_GE(copies[i], std::floor(count * w[i]));
        EXPECT_LE(copies[i], std::ceil(count * w[i]));
      }
      EXPECT_TRUE(std::is_sorted(ancestors.begin(), ancestors.end()));
    }
  }
}

TEST(Resampling, IsUnbiasedOverTheOffset) {
  const std::vector<double> w{0.13, 0.27, 0.6};
  std::vector<double> copies(3, 0.0);
  constexpr int kOffsets = 10000;
  for (int i = 0; i < kOffsets; ++i) {
    std::vector<int> ancestors;
    low_variance_resample(w, (i + 0.5) / kOffsets, 3, ancestors);
    for (const int a : ancestors) copies[a] += 1.0 / kOffsets;
  }
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(copies[i], 3 * w[i], 2.0 / kOffsets);
}
