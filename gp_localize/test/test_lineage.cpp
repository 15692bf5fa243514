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

// Two paths left, ten wanted if all had to be learned; periods of two updates.
TEST(Lineage, WantsFewerWhereLessHadToBeLearned) {
  Lineage lineage(wanted(10, 2), 40);
  lineage.restart(40);
  const auto leave_two = [&lineage] {
    std::vector<int> ancestors(40, 5);
    std::fill(ancestors.begin(), ancestors.begin() + 20, 7);
    lineage.resampled(ancestors);
  };
  leave_two();
  EXPECT_DOUBLE_EQ(lineage.tempering(equal(40)), 0.2);
  lineage.step(0.1);
  EXPECT_DOUBLE_EQ(lineage.tempering(equal(40)), 1.0);  // one is wanted
  lineage.step(0.7);
  EXPECT_DOUBLE_EQ(lineage.tempering(equal(40)), 0.5);  // four
  lineage.step(0.4);
  EXPECT_DOUBLE_EQ(lineage.tempering(equal(40)), 0.5);  // still
  field_core::State state("gp_localize", 1);
  lineage.save(state);
  Lineage restored(wanted(10, 2), 40);
  restored.restore(state, 40);
  EXPECT_DOUBLE_EQ(restored.tempering(equal(40)), 0.5);
  for (Lineage* both : {&lineage, &restored}) both->step(0.6);  // the first two are forgotten
  leave_two();
  EXPECT_DOUBLE_EQ(lineage.tempering(equal(40)), 0.4);  // five
  lineage.step(0.0);
  EXPECT_DOUBLE_EQ(lineage.tempering(equal(40)), 2.0 / (10.0 / 3.0));
  lineage.restart(40);
  leave_two();
  EXPECT_DOUBLE_EQ(lineage.tempering(equal(40)), 0.2);
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
  state.set("lineage", sound);
  for (const auto& [updates, unknown] : {std::pair{3.0, 3.1}, {-1.0, -1.0}, {3.0, double(NAN)}}) {
    state.set("lineage_periods", Eigen::MatrixXd(Eigen::Vector4d(3.0, 1.0, updates, unknown)));
    EXPECT_THROW(lineage.restore(state, 4), field_core::DataError) << updates << " " << unknown;
    state.set("lineage_periods", Eigen::MatrixXd(Eigen::Vector4d(updates, unknown, 3.0, 1.0)));
    EXPECT_THROW(lineage.restore(state, 4), field_core::DataError) << updates << " " << unknown;
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

// The saved map is known: no particle's path carries it, and so few paths are enough.
TEST(Diversity, AsksForNoPathsWhereTheMapIsKnown) {
  GpLocalizeParams p = learning(30);
  const field_core::State saved = driven(p, 90)->state();
  p.mode = Mode::lifelong;
  GpLocalize careful(p, 2), copy(p, 99);
  p.diversity.paths = 0;
  GpLocalize plain(p, 2);
  Drive drive;
  for (GpLocalize* filter : {&careful, &plain}) {
    filter->restore(saved);
    Drive().steps(*filter, 60);
  }
  drive.steps(copy, 60);
  EXPECT_LT(careful.health().paths_left, 8.0);
  EXPECT_EQ(careful.belief().mean.vector(), plain.belief().mean.vector());
  copy.restore(careful.state());
  Drive same = drive;
  drive.steps(careful, 30);
  same.steps(copy, 30);
  EXPECT_EQ(careful.belief().mean.vector(), copy.belief().mean.vector());
  EXPECT_EQ(careful.state().numbers().at("lineage_periods"),
            copy.state().numbers().at("lineage_periods"));
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
