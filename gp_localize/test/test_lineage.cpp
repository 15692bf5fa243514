// Which pasts the particles still have: counted by hand, and what it does to the filter.
#include <gtest/gtest.h>

#include <memory>

#include "exact_drive.hpp"
#include "field_core/errors.hpp"
#include "gp_localize/lineage.hpp"

using namespace gp_localize;
using std::chrono::seconds;

namespace {

ParticleSet weighted(const std::vector<double>& weights) {
  ParticleSet particles(weights.size());
  for (std::size_t i = 0; i < weights.size(); ++i) particles[i].weight = weights[i];
  return particles;
}
ParticleSet equal(int count) { return weighted(std::vector<double>(count, 1.0 / count)); }

DiversityParams wanted(int paths, int horizon) {
  DiversityParams p;
  p.paths = paths;
  p.horizon = horizon;
  return p;
}

TEST(Lineage, CountsPathsByTheWeightOfTheirParticles) {
  Lineage lineage(wanted(0, 10), 4);
  lineage.restart(4);
  EXPECT_DOUBLE_EQ(lineage.paths_left(equal(4)), 4.0);
  EXPECT_DOUBLE_EQ(lineage.paths_left(weighted({0.5, 0.5, 0.0, 0.0})), 2.0);
  lineage.resampled({0, 0, 0, 3});  // paths of 3/4 and 1/4: 16 / (9 + 1)
  EXPECT_DOUBLE_EQ(lineage.paths_left(equal(4)), 1.6);
  EXPECT_DOUBLE_EQ(lineage.paths_left(weighted({0.1, 0.2, 0.2, 0.5})), 2.0);
  lineage.resampled({3, 3, 1});  // fewer particles: path 3 has two thirds
  EXPECT_DOUBLE_EQ(lineage.paths_left(equal(3)), 9.0 / 5.0);
  lineage.resampled({2, 2, 2, 2});
  EXPECT_DOUBLE_EQ(lineage.paths_left(equal(4)), 1.0);
}

// Periods of three updates: after the second has begun, paths are those at its beginning minus one
// period, and what died before that is forgotten.
TEST(Lineage, ForgetsWhatDiedBeforeTheHorizon) {
  Lineage lineage(wanted(0, 3), 4);
  lineage.restart(4);
  lineage.resampled({0, 0, 1, 1});  // two of the start
  for (int i = 0; i < 3; ++i) lineage.step();
  lineage.resampled({0, 1, 2, 2});  // three of those after the first period
  EXPECT_DOUBLE_EQ(lineage.paths_left(equal(4)), 2.0);
  for (int i = 0; i < 2; ++i) lineage.step();
  EXPECT_DOUBLE_EQ(lineage.paths_left(equal(4)), 2.0);
  lineage.step();
  EXPECT_DOUBLE_EQ(lineage.paths_left(equal(4)), 16.0 / 6.0);
  for (int i = 0; i < 3; ++i) lineage.step();
  EXPECT_DOUBLE_EQ(lineage.paths_left(equal(4)), 4.0);
  lineage.resampled({0, 0, 0, 0});
  lineage.restart(4);
  EXPECT_DOUBLE_EQ(lineage.paths_left(equal(4)), 4.0);
}

TEST(Lineage, TempersByTheShareOfWhatIsWanted) {
  // {wanted, power} with 2 paths left to 40 particles: 10 is the most that can be wanted.
  for (const auto& [paths, power] : {std::pair{0, 1.0}, std::pair{1, 1.0}, std::pair{2, 1.0},
                                     std::pair{8, 0.25}, std::pair{10, 0.2}, std::pair{100, 0.2}}) {
    Lineage lineage(wanted(paths, 10), 100);
    lineage.restart(40);
    std::vector<int> ancestors(40, 5);
    std::fill(ancestors.begin(), ancestors.begin() + 20, 7);
    lineage.resampled(ancestors);
    EXPECT_DOUBLE_EQ(lineage.tempering(equal(40)), power) << paths;
  }
}

TEST(Lineage, RefusesADamagedState) {
  Lineage lineage(wanted(2, 10), 4);
  lineage.restart(4);
  field_core::State state("gp_localize", 1);
  lineage.save(state);
  EXPECT_THROW(lineage.restore(state, 3), field_core::DataError);
  EXPECT_NO_THROW(lineage.restore(state, 4));
  const Eigen::MatrixXd sound = state.matrix("lineage", 2, 4);
  for (const double wrong : {-1.0, 4.0, static_cast<double>(NAN)}) {
    Eigen::MatrixXd damaged = sound;
    damaged(1, 2) = wrong;
    state.set("lineage", damaged);
    EXPECT_THROW(lineage.restore(state, 4), field_core::DataError) << wrong;
  }
}

// With `adaptive`, few particles may descend from numbers that a smaller filter never has.
TEST(Lineage, GoesOnInAFilterOfFewerParticles) {
  Lineage large(wanted(0, 3), 40), small(wanted(0, 3), 4);
  large.restart(40);
  for (int i = 0; i < 3; ++i) large.step();
  large.resampled({39, 39, 7, 20});
  field_core::State state("gp_localize", 1);
  large.save(state);
  small.restore(state, 4);
  EXPECT_DOUBLE_EQ(large.paths_left(equal(4)), 16.0 / 6.0);
  EXPECT_EQ(small.paths_left(equal(4)), large.paths_left(equal(4)));
  for (Lineage* both : {&large, &small}) {
    for (int i = 0; i < 3; ++i) both->step();
    both->resampled({0, 2, 3, 3});  // of 39, 7 and 20, twice
  }
  EXPECT_EQ(small.paths_left(equal(4)), large.paths_left(equal(4)));
}

GpLocalizeParams learning(int paths) {
  GpLocalizeParams p = resampling(exact_params());
  p.fields["light"].noise_stddev = 0.05;  // a world that it does not expect leaves few paths
  p.diversity = wanted(paths, 30);
  return p;
}

struct Drive {
  field_core::SE2 pose;
  int time = 0;
  void steps(GpLocalize& filter, int count) {
    for (int i = 0; i < count; ++i, ++time) {
      pose = pose * exact_motion(time);
      filter.predict({seconds(time), seconds(time + 1), exact_motion(time)});
      const double light = 3.0 + std::sin(1.3 * pose.x()) * std::cos(pose.y());
      filter.update({seconds(time + 1), {}, {{0, light, 0.0}}});
    }
  }
};

std::unique_ptr<GpLocalize> driven(const GpLocalizeParams& params, int steps) {
  auto filter = std::make_unique<GpLocalize>(params, 1);
  Drive().steps(*filter, steps);
  return filter;
}

double effective_number(const GpLocalize& filter) {
  double squares = 0.0;
  for (const auto& p : filter.belief().particles) squares += p.weight * p.weight;
  return 1.0 / squares;
}

// No resampling: the weights' effective number is that of the paths.
TEST(Diversity, RaisesTheLikelihoodToThePowerThatKeepsPaths) {
  GpLocalizeParams p = learning(0);
  p.resample_threshold = 0.0;
  p.diversity.horizon = 1000;
  const auto plain = driven(p, 90);
  p.diversity.paths = 15;
  const auto careful = driven(p, 90);
  EXPECT_NEAR(plain->health().paths_left, effective_number(*plain), 1e-9);
  EXPECT_NEAR(careful->health().paths_left, effective_number(*careful), 1e-9);
  EXPECT_LT(plain->health().paths_left, 15.0);
  EXPECT_GT(careful->health().paths_left, 1.2 * plain->health().paths_left);
}

TEST(Diversity, CountsThePathsOfTheHorizon) {
  GpLocalizeParams p = learning(0);
  p.diversity.horizon = 10;
  const auto recent = driven(p, 85);
  p.diversity.horizon = 1000;
  const auto all = driven(p, 85);
  EXPECT_GT(recent->health().paths_left, 1.2 * all->health().paths_left);
}

TEST(Diversity, ARestoredStateGoesOnBitForBit) {
  for (const int steps : {50, 80}) {
    GpLocalize original(learning(30), 5), copy(learning(30), 99);
    Drive drive;
    drive.steps(original, steps);
    copy.restore(original.state());
    EXPECT_LT(original.health().paths_left, 15.0);
    EXPECT_EQ(original.health().paths_left, copy.health().paths_left);
    Drive same = drive;
    drive.steps(original, 15);
    same.steps(copy, 15);
    EXPECT_EQ(original.belief().mean.vector(), copy.belief().mean.vector());
    EXPECT_EQ(original.health().paths_left, copy.health().paths_left);
  }
}

TEST(Diversity, IsOfNoConcernWhereNoPathCarriesAMap) {
  GpLocalizeParams p = learning(30);
  p.map_hypotheses = MapHypotheses::sample_paths;
  p.sample_paths = 20;
  const auto shared = driven(p, 80);
  p.diversity.paths = 0;
  const auto plain = driven(p, 80);
  EXPECT_EQ(shared->health().paths_left, 0.0);
  EXPECT_EQ(shared->belief().mean.vector(), plain->belief().mean.vector());
}

}  // namespace
