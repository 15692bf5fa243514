// Groups of similar places: what they leave out of a covariance stays within the bound they give.
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "dense_reference.hpp"
#include "gmrf_slap/field_prior.hpp"
#include "place_groups.hpp"

using namespace gmrf_slap;

namespace {

struct World {
  Lattice lattice{{0.0, 0.0}, 1.0, 9, 9, true};
  Eigen::SparseMatrix<double> precision = prior_precision(lattice, {1.0, 0.1, 2});
  Eigen::MatrixXd sigma = Eigen::MatrixXd(precision).inverse();
  std::unique_ptr<GaussianField> field = make_dense_field(precision);

  /// `count` places with curvatures of both signs, from far below the heaviest on.
  std::vector<PlaceGroups::Place> places(int count, Interpolation interpolation) const {
    field_core::Random random(3);
    std::vector<PlaceGroups::Place> out;
    for (int k = 0; k < count; ++k) {
      PlaceGroups::Place place;
      place.row = lattice.row({random.uniform(0.0, 8.0), random.uniform(0.0, 8.0)}, interpolation);
      place.curvature = std::exp(random.uniform(-6.0, 0.0)) * (k % 3 == 0 ? -0.1 : 0.1);
      const Eigen::VectorXd a = test::dense_row(place.row, 81);
      place.variance = a.dot(sigma * a);
      out.push_back(place);
    }
    return out;
  }
};

struct Errors {
  Eigen::MatrixXd positive = Eigen::MatrixXd::Zero(81, 81), negative = positive;
  double largest_loss = 0.0, positive_loss = 0.0, negative_loss = 0.0;
};

/// Group by group from the definition. E = Sigma N Sigma; N is kept.
Errors errors_of(const World& world, const std::vector<PlaceGroups::Place>& places,
                 const PlaceGroups& groups) {
  Errors out;
  for (std::size_t i = 0; i < places.size();) {
    EXPECT_TRUE(groups.starts()[i]);
    std::size_t end = i + 1;
    while (end < places.size() && !groups.starts()[end]) ++end;
    double sum = 0.0;
    Eigen::VectorXd mean = Eigen::VectorXd::Zero(81);
    for (std::size_t j = i; j < end; ++j) {
      const auto& place = places[static_cast<std::size_t>(groups.order()[j])];
      sum += place.curvature;
      mean += place.curvature * test::dense_row(place.row, 81);
    }
    mean /= sum;
    double loss = 0.0;
    for (std::size_t j = i; j < end; ++j) {
      const auto& place = places[static_cast<std::size_t>(groups.order()[j])];
      EXPECT_GT(place.curvature * sum, 0.0);
      const Eigen::VectorXd d = test::dense_row(place.row, 81) - mean;
      loss += std::abs(place.curvature) * d.dot(world.sigma * d);
      (sum > 0.0 ? out.positive : out.negative) += std::abs(place.curvature) * d * d.transpose();
    }
    (sum > 0.0 ? out.positive_loss : out.negative_loss) += loss;
    out.largest_loss = std::max(out.largest_loss, loss);
    i = end;
  }
  return out;
}

/// Largest x^T E x / x^T Sigma x, E = Sigma N Sigma.
double largest_share(const World& world, const Eigen::MatrixXd& n) {
  const Eigen::MatrixXd root = Eigen::LLT<Eigen::MatrixXd>(world.sigma).matrixL();
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(root.transpose() * n * root)
      .eigenvalues()
      .maxCoeff();
}

class Groups : public ::testing::TestWithParam<Interpolation> {};

TEST_P(Groups, LoseWhatTheySayAndNoMoreThanAllowed) {
  const World world;
  const auto places = world.places(120, GetParam());
  int before = 121;
  for (const double largest : {1e-6, 1e-4, 1e-3}) {
    PlaceGroups groups;
    groups.build(*world.field, places, largest, 1.0);
    const Errors errors = errors_of(world, places, groups);
    // Losses are near 1e-4 and differences of numbers near 1: twelve digits of them are left.
    EXPECT_NEAR(errors.positive_loss, groups.positive_loss(), 1e-13);
    EXPECT_NEAR(errors.negative_loss, groups.negative_loss(), 1e-13);
    EXPECT_LE(errors.largest_loss, largest + 1e-13);
    EXPECT_LE(largest_share(world, errors.positive), groups.positive_loss() + 1e-15);
    EXPECT_LE(largest_share(world, errors.negative), groups.negative_loss() + 1e-15);
    // Directions differ: of 20 to 60 groups the largest share is that of a few.
    EXPECT_LE(largest_share(world, errors.positive), 6.0 * largest);
    EXPECT_LT(groups.size(), before);
    before = groups.size();
    std::vector<int> all = groups.order();
    std::sort(all.begin(), all.end());
    for (int k = 0; k < 120; ++k) EXPECT_EQ(all[static_cast<std::size_t>(k)], k);
  }
}

INSTANTIATE_TEST_SUITE_P(Rows, Groups,
                         ::testing::Values(Interpolation::nearest, Interpolation::bilinear));

TEST(PlaceGroups, NegativeOnesKeepTheirBudget) {
  const World world;
  const auto places = world.places(120, Interpolation::bilinear);
  PlaceGroups groups;
  groups.build(*world.field, places, 1e-3, 1.0);
  const double free = groups.negative_loss(), others = groups.positive_loss();
  groups.build(*world.field, places, 1e-3, 0.3 * free);
  EXPECT_LE(groups.negative_loss(), 0.3 * free);
  EXPECT_GT(groups.negative_loss(), 0.0);
  EXPECT_EQ(groups.positive_loss(), others);
}

TEST(PlaceGroups, WithoutLossEveryPlaceIsItsOwn) {
  const World world;
  const auto places = world.places(40, Interpolation::bilinear);
  PlaceGroups groups;
  groups.build(*world.field, places, 0.0, 1.0);
  EXPECT_EQ(groups.size(), 40);
  EXPECT_EQ(groups.positive_loss() + groups.negative_loss(), 0.0);
}

}  // namespace
