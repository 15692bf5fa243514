// Modes localization and lifelong: maps from a survey or a saved state, global localization,
// recovery, and the verdict "lost" on healthy and on lost runs.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "dense_reference.hpp"
#include "field_core/errors.hpp"
#include "gp_localize/gp_localize.hpp"
#include "gp_localize/survey.hpp"

using namespace gp_localize;
using field_core::SE2;
using std::chrono::seconds;

namespace {

double light_at(const Eigen::Vector2d& p) {
  return 7.0 + 2.0 * std::sin(0.9 * p.x()) * std::cos(0.8 * p.y()) + 0.3 * p.x();
}
double heat_at(const Eigen::Vector2d& p) { return 20.0 + std::sin(0.5 * p.x() - 0.7 * p.y()); }

class KnownMap : public ::testing::Test {
 protected:
  KnownMap() {
    std::string name = (std::filesystem::temp_directory_path() / "known_map.XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    std::ofstream csv(survey());
    csv << "x_m,y_m,light,heat\n";
    for (int i = 0; i < 17 * 17; ++i) {
      const Eigen::Vector2d p(-4.0 + 0.5 * (i % 17), -4.0 + 0.5 * (i / 17));
      csv << p.x() << "," << p.y() << "," << light_at(p) + 0.1 * random_.normal() << ",";
      if (i % 2 == 0) csv << heat_at(p) + 0.1 * random_.normal();
      csv << "\n";
    }
  }
  ~KnownMap() override { std::filesystem::remove_all(folder_); }
  std::string survey() const { return folder_ + "/survey.csv"; }

  GpLocalizeParams params(Mode mode) const {
    GpLocalizeParams p;
    FieldParams light, heat;
    light.mean = 7.0;
    light.signal_stddev = 2.0;
    light.noise_stddev = 0.15;
    light.length_scales = {1.8, 1.8};
    heat.mean = 20.0;
    heat.signal_stddev = 1.0;
    heat.noise_stddev = 0.15;
    heat.length_scales = {2.5, 2.5};
    p.fields = {{"light", light}, {"heat", heat}};
    p.mode = mode;
    p.survey = survey();
    p.particles = 300;
    p.support.region = {-4.0, -4.0, 4.0, 4.0};
    p.support.size = 81;
    p.initial_pose_x = 2.0;
    p.initial_cov_xx = p.initial_cov_yy = p.initial_cov_aa = 0.01;
    p.odometry_noise = {0.01, 0.01, 0.01, 0.01};
    return p;
  }

  /// One step on a wobbling circle around the origin; returns the error of the estimate.
  double step(GpLocalize& filter, bool with_noise = true) {
    const SE2 delta(0.3, 0.0, 0.15 + 0.1 * std::sin(0.2 * time_));
    truth_ = truth_ * delta;
    filter.predict({seconds(time_), seconds(time_ + 1), delta});
    ++time_;
    const double noise = with_noise ? 0.1 : 0.0;
    const Eigen::Vector2d p = truth_.translation();
    filter.update({seconds(time_),
                   {},
                   {{0, heat_at(p) + noise * random_.normal(), 0.0},
                    {1, light_at(p) + noise * random_.normal(), 0.0}}});
    return (filter.belief().mean.translation() - p).norm();
  }

  std::string folder_;
  field_core::Random random_{8};
  SE2 truth_{2.0, 0.0, 0.0};
  int time_ = 0;
};

TEST_F(KnownMap, SurveyIsPitcInBlocksOfItsRows) {
  const GpLocalizeParams p = params(Mode::localization);
  GpLocalize filter(p, 1);
  const auto models = make_field_models(p);
  const auto all = read_survey(survey(), {"light"}).at("light");
  const auto& basis = models[1].basis;
  const test::DenseField dense{basis.kernel(), basis.support(),
                               p.support.jitter * basis.kernel().signal_variance(),
                               models[1].noise_variance};
  std::vector<int> blocks(all.values.size());
  for (std::size_t i = 0; i < blocks.size(); ++i) blocks[i] = static_cast<int>(i) / 50;
  Eigen::Matrix2Xd query(2, 2);
  query << 0.3, 2.7, -1.1, 3.2;
  const auto prediction = filter.predict_field(query);
  for (int q = 0; q < 2; ++q) {
    const auto expected = test::block_regression(dense, all.places, all.values.array() - 7.0,
                                                 blocks, query.col(q), -1);
    EXPECT_NEAR(prediction.mean(1, q), expected.mean + 7.0, 1e-5);
    EXPECT_NEAR(prediction.variance(1, q), expected.variance + models[1].noise_variance, 1e-6);
    EXPECT_NEAR(prediction.mean(1, q), light_at(query.col(q)), 0.2);  // and it is the field
  }
}

TEST_F(KnownMap, LocalizationLeavesTheMapAloneAndLifelongLearns) {
  Eigen::Matrix2Xd query(2, 1);
  query << 2.0, 0.5;
  for (const Mode mode : {Mode::localization, Mode::lifelong}) {
    GpLocalize filter(params(mode), 1);
    const auto before = filter.predict_field(query);
    truth_ = SE2(2.0, 0.0, 0.0);
    for (int i = 0; i < 20; ++i) step(filter);
    const auto after = filter.predict_field(query);
    if (mode == Mode::localization) {
      EXPECT_NEAR(after.mean(1, 0), before.mean(1, 0), 1e-12);
      EXPECT_NEAR(after.variance(1, 0), before.variance(1, 0), 1e-12);
    } else {
      EXPECT_NE(after.mean(1, 0), before.mean(1, 0));
    }
  }
}

TEST_F(KnownMap, StateSavedWhileMappingIsTheMap) {
  GpLocalizeParams mapping = params(Mode::mapping);
  mapping.survey.clear();
  GpLocalize mapper(mapping, 3);
  for (int i = 0; i < 60; ++i) step(mapper);
  GpLocalizeParams p = params(Mode::localization);
  p.survey.clear();
  p.particles = 500;
  GpLocalize filter(p, 4);
  Eigen::Matrix2Xd query(2, 1);
  query << truth_.x(), truth_.y();
  EXPECT_NEAR(filter.predict_field(query).variance(1, 0), 4.0 + 0.15 * 0.15, 1e-9);
  filter.restore(mapper.state());
  EXPECT_NEAR(filter.belief().mean.x(), 2.0, 0.05);  // the start of the parameters
  EXPECT_EQ(filter.belief().particles.size(), 500u);
  const auto a = filter.predict_field(query), b = mapper.predict_field(query);
  EXPECT_NEAR(a.mean(1, 0), b.mean(1, 0), 0.2);
  EXPECT_LT(a.variance(1, 0), 1.0);
  truth_ = SE2(2.0, 0.0, 0.0);
  time_ = 0;
  double error = 0.0;
  for (int i = 0; i < 40; ++i) error += step(filter) / 40;
  EXPECT_LT(error, 0.4);  // 0.1 to 0.2 with other seeds
  // A state of the same mode is taken over bit for bit.
  GpLocalize copy(p, 9);
  copy.restore(filter.state());
  EXPECT_EQ(copy.belief().mean.vector(), filter.belief().mean.vector());
}

TEST_F(KnownMap, GlobalLocalizationFindsThePose) {
  int found = 0;
  for (int seed = 1; seed <= 5; ++seed) {
    GpLocalizeParams p = params(Mode::localization);
    p.particles = 3000;
    p.adaptive.min_particles = 200;
    GpLocalize filter(p, seed);
    filter.scatter();
    EXPECT_EQ(filter.belief().particles.size(), 3000u);
    truth_ = SE2(-1.0 + 0.4 * seed, -2.0, 0.5);
    for (int i = 0; i < 60; ++i) step(filter);
    const double error = (filter.belief().mean.translation() - truth_.translation()).norm();
    if (error >= 0.5) continue;
    ++found;
    EXPECT_LT(filter.belief().particles.size(), 1500u);  // it needs fewer now
  }
  EXPECT_GE(found, 4);
}

/// Share of 100 steps on which the filter says that it is lost, and its error at the end.
struct Verdict {
  double lost = 0.0, error = 0.0;
};

TEST_F(KnownMap, LostOnlyWhenItIs) {
  constexpr int kSeeds = 6, kSteps = 100;
  Verdict healthy, kidnapped, recovered;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    for (Verdict* verdict : {&healthy, &kidnapped, &recovered}) {
      GpLocalizeParams p = params(Mode::localization);
      p.lost.recovery_share = verdict == &recovered ? 0.1 : 0.0;
      GpLocalize filter(p, seed);
      truth_ = SE2(2.0, 0.0, 0.0);
      for (int i = 0; i < 30; ++i) step(filter);
      if (verdict != &healthy) truth_ = SE2(0.3, -0.7, 2.0);  // carried away
      for (int i = 0; i < kSteps; ++i) {
        const double error = step(filter);
        if (filter.health().lost) verdict->lost += 1.0 / (kSteps * kSeeds);
        if (i >= kSteps - 10) verdict->error += error / (10 * kSeeds);
      }
    }
  }
  EXPECT_EQ(healthy.lost, 0.0);  // no false alarm
  EXPECT_LT(healthy.error, 0.3);
  EXPECT_GT(kidnapped.lost, 0.4);  // without recovery it stays lost or comes home by luck
  EXPECT_GT(kidnapped.error, 2.0 * recovered.error);
  EXPECT_LT(recovered.error, 0.6);
  EXPECT_GT(recovered.lost, 0.0);
  EXPECT_LT(recovered.lost, kidnapped.lost);
}

TEST_F(KnownMap, TooUncertainIsLostToo) {
  GpLocalizeParams p = params(Mode::localization);
  p.lost.stddev = 1.0;
  p.initial_cov_xx = 4.0;
  GpLocalize filter(p, 1);
  filter.update({seconds(0), {}, {{1, 7.0, 1e6}}});  // a measurement that says nothing
  EXPECT_TRUE(filter.health().lost);
  EXPECT_STREQ(filter.health().reason, "the pose is too uncertain");
  filter.set_pose(SE2(), Eigen::Vector3d(0.01, 0.01, 0.01).asDiagonal());
  EXPECT_FALSE(filter.health().lost);
}

TEST_F(KnownMap, SupportMayFollowTheSurvey) {
  GpLocalizeParams p = params(Mode::localization);
  p.support.selection = SupportSelection::survey;
  p.support.size = 400;  // more than the survey has places
  const auto models = make_field_models(p);
  EXPECT_EQ(models[0].basis.size(), 17 * 17);
}

TEST_F(KnownMap, RefusesWhatCannotWork) {
  GpLocalizeParams p = params(Mode::localization);
  p.map_hypotheses = MapHypotheses::sample_paths;
  EXPECT_THROW(p.validate(), field_core::ParameterError);
  p = params(Mode::localization);
  p.survey = folder_ + "/none.csv";
  EXPECT_THROW(GpLocalize(p, 1), field_core::DataError);
  p = params(Mode::mapping);
  p.survey.clear();
  p.support.selection = SupportSelection::survey;
  EXPECT_THROW(p.validate(), field_core::ParameterError);
}

}  // namespace
