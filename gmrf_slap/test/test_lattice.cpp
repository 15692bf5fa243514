#include <gtest/gtest.h>

#include "field_core/errors.hpp"
#include "field_core/random.hpp"
#include "gmrf_slap/lattice.hpp"

using namespace gmrf_slap;
using Eigen::Vector2d;

namespace {

TEST(Lattice, SitesAndPositionsBelongTogether) {
  const Lattice lattice({-15.0, 2.0}, 0.5, 7, 4, false);
  EXPECT_EQ(lattice.sites(), 28);
  EXPECT_EQ(lattice.position(lattice.site(6, 3)), Vector2d(-12.0, 3.5));
  for (int s = 0; s < lattice.sites(); ++s) {
    EXPECT_EQ(lattice.nearest(lattice.position(s) + Vector2d(0.24, -0.24)), s);
  }
}

TEST(Lattice, BoundedDomainEndsHalfASpacingBeyondTheSites) {
  const Lattice lattice({0.0, 0.0}, 2.0, 3, 3, false);
  EXPECT_TRUE(lattice.contains({-1.0, 5.0}));
  EXPECT_FALSE(lattice.contains({-1.01, 0.0}));
  EXPECT_FALSE(lattice.contains({0.0, std::nan("")}));
  EXPECT_EQ(lattice.nearest({-9.0, 100.0}), lattice.site(0, 2));
}

TEST(Lattice, TorusJoinsOppositeEdgesButRobotsStayInside) {
  const Lattice lattice({-15.0, -15.0}, 1.0, 31, 31, true);
  EXPECT_EQ(lattice.nearest({15.6, 0.0}), lattice.site(0, 15));
  EXPECT_EQ(lattice.nearest({46.0, -31.0}), lattice.site(30, 15));
  EXPECT_TRUE(lattice.contains({15.4, 0.0}));
  EXPECT_FALSE(lattice.contains({15.6, 0.0}));
}

TEST(Lattice, BilinearRowsReproduceEveryLinearFunction) {
  // Bilinear elements hold 1, x, y and x y exactly inside a cell.
  const Lattice lattice({-2.0, 1.0}, 0.7, 6, 5, false);
  field_core::Random random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const Vector2d p(random.uniform(-2.0, 1.5), random.uniform(1.0, 3.8));
    const SiteRow row = lattice.row(p, Interpolation::bilinear);
    double sum = 0.0;
    Vector2d mean = Vector2d::Zero();
    for (std::size_t i = 0; i < static_cast<std::size_t>(row.count); ++i) {
      EXPECT_GT(row.weight[i], 0.0);
      sum += row.weight[i];
      mean += row.weight[i] * lattice.position(row.site[i]);
    }
    EXPECT_NEAR(sum, 1.0, 1e-14);
    EXPECT_LT((mean - p).norm(), 1e-13);
  }
}

TEST(Lattice, BilinearRowsCrossTheSeamOfATorus) {
  const Lattice lattice({0.0, 0.0}, 1.0, 4, 3, true);
  const SiteRow row = lattice.row({3.25, 2.5}, Interpolation::bilinear);
  ASSERT_EQ(row.count, 4);
  EXPECT_EQ(row.site[0], lattice.site(3, 2));
  EXPECT_EQ(row.site[3], lattice.site(0, 0));
  EXPECT_NEAR(row.weight[3], 0.125, 1e-15);
}

TEST(Lattice, OutsideABoundedLatticeTheNearestPointInsideCounts) {
  const Lattice lattice({0.0, 0.0}, 1.0, 3, 3, false);
  const SiteRow row = lattice.row({7.0, 1.0}, Interpolation::bilinear);
  ASSERT_EQ(row.count, 1);
  EXPECT_EQ(row.site[0], lattice.site(2, 1));
}

TEST(Lattice, RefusesImpossibleShapes) {
  EXPECT_THROW(Lattice({0, 0}, 0.0, 3, 3, false), field_core::ParameterError);
  EXPECT_THROW(Lattice({0, 0}, 1.0, 0, 3, false), field_core::ParameterError);
  EXPECT_THROW(Lattice({0, 0}, 1.0, 2, 3, true), field_core::ParameterError);
  EXPECT_NO_THROW(Lattice({0, 0}, 1.0, 1, 1, false));
}

}  // namespace
