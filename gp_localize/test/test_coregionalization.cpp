// Groups of correlated fields, in both kinds of maps, against dense regression with the joint
// covariance over places and fields.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../src/particle_map.hpp"
#include "../src/path_bank.hpp"
#include "correlated_reference.hpp"
#include "field_core/errors.hpp"

using namespace gp_localize;
using field_core::SE2;
using test::Read;

namespace {

constexpr int kSlice = 4, kParticles = 7;

/// Fields a, b, c of one group, which names them in another order, and d on its own.
GpLocalizeParams params() {
  GpLocalizeParams p;
  FieldParams f;
  f.length_scales = {1.5, 2.0};
  const double signal[] = {1.4, 0.7, 20.0}, noise[] = {0.3, 0.1, 5.0};
  for (int i = 0; i < 3; ++i) {
    f.signal_stddev = signal[i];
    f.noise_stddev = noise[i];
    p.fields[std::string(1, static_cast<char>('a' + i))] = f;
  }
  f.kernel = field_core::KernelType::matern52;
  f.length_scales = {3.0, 3.0};
  p.fields["d"] = f;
  p.coregionalization["room"] = {{"c", "a", "b"}, {0.6, -0.5, 0.2}};
  p.particles = kParticles;
  p.sample_paths = 3;
  p.slice_size = kSlice;
  p.precision = Precision::double_precision;
  p.support.region = {-3.0, -3.0, 3.0, 3.0};
  p.support.size = 16;
  p.support.jitter = 1e-6;
  return p;
}

/// B of a, b, c written out, in the order of their names.
Eigen::Matrix3d covariance() {
  const double a = 1.4, b = 0.7, c = 20.0;
  Eigen::Matrix3d m;
  m << a * a, 0.2 * a * b, 0.6 * a * c,  //
      0.2 * a * b, b * b, -0.5 * b * c,  //
      0.6 * a * c, -0.5 * b * c, c * c;
  return m;
}

test::CorrelatedFields reference(const GpLocalizeParams& p, const std::vector<FieldModel>& models) {
  return {covariance(), Eigen::Vector2d(1.5, 2.0), models[0].basis.support(), p.support.jitter};
}

/// What is read at a step: not every field every time. d has its own noise and is never correlated.
std::vector<Observation> observe(const std::vector<FieldModel>& models, int step,
                                 field_core::Random& random) {
  std::vector<Observation> all;
  for (const int f : {2, 0, 3, 1}) {
    if ((step + f) % 3 == 1) continue;
    const double noise = models[f].noise_variance;
    const double signal = std::sqrt(models[f].signal_variance());
    all.push_back({f, signal * random.normal(), noise, 4.0 * noise});
  }
  return all;
}

/// Readings of slices that are closed.
std::vector<Read> closed(std::vector<Read> history, int step) {
  history.erase(std::remove_if(history.begin(), history.end(),
                               [step](const Read& r) { return r.block >= step / kSlice; }),
                history.end());
  return history;
}

/// Log density of the group's readings, as dense regression has it.
double expected_density(const test::CorrelatedFields& dense, const std::vector<Read>& history,
                        const Eigen::Vector2d& at, const std::vector<Observation>& observations,
                        int block) {
  std::vector<int> fields;
  Eigen::VectorXd z(4), noise(4);
  for (const Observation& o : observations) {
    if (o.field == 3) continue;
    z[fields.size()] = o.value;
    noise[fields.size()] = o.likelihood_variance;
    fields.push_back(o.field);
  }
  const auto n = static_cast<Eigen::Index>(fields.size());
  if (n == 0) return 0.0;
  return test::log_density(dense.regress(history, at, fields, block), z.head(n), noise.head(n));
}

std::vector<Observation> without_d(std::vector<Observation> observations) {
  observations.erase(std::remove_if(observations.begin(), observations.end(),
                                    [](const Observation& o) { return o.field == 3; }),
                     observations.end());
  return observations;
}

TEST(Coregionalization, GroupsAreNumberedAndNamed) {
  const auto models = make_field_models(params());
  ASSERT_EQ(4u, models.size());
  const int group[] = {0, 0, 0, 1}, member[] = {1, 2, 0, 0};
  for (int f = 0; f < 4; ++f) {
    EXPECT_EQ(group[f], models[f].group);
    EXPECT_EQ(member[f], models[f].member);
  }
  EXPECT_EQ((std::vector<int>{0, 3}), first_fields(models));
  EXPECT_NEAR(0.7 * 0.7, models[1].signal_variance(), 1e-12);
  EXPECT_NEAR(-0.5 * 0.7 * 20.0, models[0].basis.prior(0, 2), 1e-12);
}

class InParticles : public ::testing::TestWithParam<ObservationModelType> {
 protected:
  InParticles() {
    p.observation_model = GetParam();
    models = make_field_models(p);
    map = std::make_unique<ParticleMap>(p, models);
    particles.resize(kParticles);
    for (Particle& particle : particles) particle.weight = 1.0 / kParticles;
  }
  int block() const { return GetParam() == ObservationModelType::online_pitc ? step / kSlice : -1; }
  /// What the model uses of a particle's readings.
  std::vector<Read> used(int particle) const {
    return block() < 0 ? closed(histories[particle], step) : histories[particle];
  }
  void advance() {
    const auto observations = observe(models, step, random);
    for (Particle& particle : particles) {
      particle.pose = SE2(particle.pose.vector() +
                          0.5 * Eigen::Vector3d(random.normal(), random.normal(), 0.0));
    }
    std::vector<double> log_likelihood, alone;
    Innovation innovation;
    std::vector<Observation> d;
    for (const Observation& o : observations) {
      if (o.field == 3) d.push_back(o);
    }
    map->weigh(particles, SE2(), d, alone, innovation);  // of d, which is independent
    map->weigh(particles, SE2(), observations, log_likelihood, innovation);
    const auto dense = reference(p, models);
    for (int i = 0; i < kParticles; ++i) {
      const auto at = particles[i].pose.translation();
      const double expected =
          expected_density(dense, used(i), at, observations, block()) + alone[i];
      // As in test_particle_map: condition 1e6 of the support.
      EXPECT_NEAR(expected, log_likelihood[i], 1e-8) << "particle " << i << ", step " << step;
    }
    map->learn(particles, SE2(), observations, random);
    for (int i = 0; i < kParticles; ++i) {
      for (const Observation& o : without_d(observations)) {
        histories[i].push_back(
            {particles[i].pose.translation(), o.field, o.value, o.noise_variance, step / kSlice});
      }
    }
    ++step;
  }
  void resample() {
    std::vector<int> ancestors(kParticles);
    for (int& a : ancestors) a = static_cast<int>(random.index(kParticles));
    std::sort(ancestors.begin(), ancestors.end());
    const auto old_particles = particles;
    const auto old_histories = histories;
    for (int i = 0; i < kParticles; ++i) {
      particles[i] = old_particles[ancestors[i]];
      histories[i] = old_histories[ancestors[i]];
    }
    map->resampled(ancestors);
  }
  void expect_predictions(const MapModel& predicted) const {
    const auto dense = reference(p, models);
    const Eigen::Vector2d query(0.4, -0.9);
    for (int f = 0; f < 3; ++f) {
      Eigen::VectorXd mean, variance;
      predicted.predict(f, query, particles, mean, variance);
      double m = 0.0, square = 0.0;
      for (int i = 0; i < kParticles; ++i) {
        const auto d = dense.regress(used(i), query, {f}, block());
        m += particles[i].weight * d.mean[0];
        square += particles[i].weight * (d.covariance(0, 0) + d.mean[0] * d.mean[0]);
      }
      const double scale = models[f].signal_variance();
      EXPECT_NEAR(m, mean[0], 1e-9 * std::max(1.0, scale)) << "field " << f;
      EXPECT_NEAR(square - m * m, variance[0], 1e-9 * std::max(1.0, scale)) << "field " << f;
    }
  }

  GpLocalizeParams p = params();
  std::vector<FieldModel> models;
  std::unique_ptr<ParticleMap> map;
  field_core::Random random{5};
  ParticleSet particles;
  std::vector<std::vector<Read>> histories{kParticles};
  int step = 0;
};
INSTANTIATE_TEST_SUITE_P(Models, InParticles,
                         ::testing::Values(ObservationModelType::online_pitc,
                                           ObservationModelType::online_pitc_assimilated));

TEST_P(InParticles, EveryParticleKnowsItsOwnPath) {
  for (int i = 0; i < 14; ++i) {
    advance();
    if (i % 2 == 0 || i % 7 == 0) resample();
  }
  expect_predictions(*map);
}

TEST_P(InParticles, StateIsTakenOver) {
  for (int i = 0; i < 6; ++i) advance();  // in the middle of a slice
  resample();
  field_core::State state("map", 1);
  map->save(state);
  auto copy = std::make_unique<ParticleMap>(p, models);
  std::vector<int> each(kParticles);
  for (int i = 0; i < kParticles; ++i) each[i] = i;
  copy->restore(state, each);
  expect_predictions(*copy);
  map = std::move(copy);
  for (int i = 0; i < 5; ++i) advance();
}

/// Sample paths: the banks of the group along three paths, and particles that stand elsewhere.
class InPaths : public ::testing::TestWithParam<std::tuple<ObservationModelType, Precision>> {};
INSTANTIATE_TEST_SUITE_P(
    Models, InPaths,
    ::testing::Combine(::testing::Values(ObservationModelType::online_pitc,
                                         ObservationModelType::online_pitc_assimilated),
                       ::testing::Values(Precision::double_precision,
                                         Precision::single_precision)));

TEST_P(InPaths, JointDensityIsDenseRegression) {
  GpLocalizeParams p = params();
  p.map_hypotheses = MapHypotheses::sample_paths;
  p.observation_model = std::get<0>(GetParam());
  p.precision = std::get<1>(GetParam());
  const bool recent = p.observation_model == ObservationModelType::online_pitc;
  // Condition 1e6 of the support, times the seven digits of single precision.
  const double tolerance = p.precision == Precision::double_precision ? 1e-8 : 0.02;
  const auto models = make_field_models(p);
  const auto dense = reference(p, models);
  const auto bank = make_path_bank(p, models[0]);
  bank->restart();
  field_core::Random random(2);
  constexpr int kManyParticles = 70;  // more than are prepared at a time
  std::vector<std::vector<Read>> histories(p.sample_paths);
  const auto used = [&](int path, int step) {
    return recent ? histories[path] : closed(histories[path], step);
  };
  const auto draw = [&](int n) {
    Places places(2, n);
    for (double& x : places.reshaped()) x = random.uniform(-3.0, 3.0);
    return places;
  };
  for (int step = 0; step < 2 * kSlice + 3; ++step) {
    const auto observations = without_d(observe(models, step, random));
    const Places particles = draw(kManyParticles), paths = draw(p.sample_paths);
    const int block = recent ? step / kSlice : -1;
    std::vector<Reading> readings;
    for (const Observation& o : observations) {
      readings.push_back({models[o.field].member, o.value, o.likelihood_variance});
    }
    std::vector<Eigen::Matrix2Xd> moments;
    bank->begin(kManyParticles);
    bank->add_joint(particles, readings, *bank, moments);
    std::vector<double> log_likelihood;
    bank->log_mean(log_likelihood);
    for (int i = 0; i < kManyParticles; i += 9) {
      double sum = 0.0, first = 0.0;
      for (int c = 0; c < p.sample_paths; ++c) {
        const auto history = used(c, step);
        const Eigen::Vector2d at = particles.col(i);
        sum += std::exp(expected_density(dense, history, at, observations, block)) / 3;
        first += dense.regress(history, at, {observations[0].field}, block).mean[0] / 3;
      }
      EXPECT_NEAR(std::log(sum), log_likelihood[i], tolerance) << "step " << step;
      EXPECT_NEAR(first, moments[0](0, i), 20.0 * tolerance);
    }
    for (const Observation& o : observations) {
      bank->learn(models[o.field].places(paths), o.value, o.noise_variance);
      for (int c = 0; c < p.sample_paths; ++c) {
        histories[c].push_back({paths.col(c), o.field, o.value, o.noise_variance, step / kSlice});
      }
    }
    if ((step + 1) % kSlice == 0) bank->close_slice();
  }
  const Eigen::Vector2d query(0.3, 1.2);
  for (int f = 0; f < 3; ++f) {
    Eigen::Matrix2Xd moments;
    bank->predict(models[f].places(query), moments);
    double mean = 0.0;
    for (int c = 0; c < p.sample_paths; ++c) {
      mean += dense.regress(used(c, 2 * kSlice + 3), query, {f}, recent ? 2 : -1).mean[0] / 3;
    }
    EXPECT_NEAR(mean, moments(0, 0), 20.0 * 1e-9);
  }
}

TEST(Coregionalization, SupportThatGrewIsThatOfAllPointsFromTheStart) {
  const field_core::Kernel kernel(field_core::KernelType::matern32, 1.0, {1.5, 2.0});
  const Coregionalization group(covariance());
  field_core::Random random(7);
  Places support(2, 6), places(3, 20);
  for (double& x : support.reshaped()) x = random.uniform(-3.0, 3.0);
  for (Eigen::Index i = 0; i < places.cols(); ++i) {
    places.col(i) << random.uniform(-3.0, 3.0), random.uniform(-3.0, 3.0), double(i % 3);
  }
  const SupportBasis whole(kernel, support, 1e-6, 0.0, 0, group);
  SupportBasis grown(kernel, support.leftCols(4), 1e-6, 0.0, 2, group);
  Features before, after, expected;
  grown.features(places, before);
  for (int i = 4; i < 6; ++i) {
    grown.grow(support.col(i));
    for (Eigen::Index c = 0; c < places.cols(); ++c) {
      Eigen::VectorXd phi = before.col(c);
      grown.add_newest_features(places.col(c), phi.data());
      before.col(c) = phi;
    }
  }
  EXPECT_FALSE(grown.has_room());
  grown.features(places, after);
  whole.features(places, expected);
  EXPECT_LT((after - before).cwiseAbs().maxCoeff(), 1e-12);
  const Eigen::MatrixXd difference = after.transpose() * after - expected.transpose() * expected;
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-8 * covariance().maxCoeff());
  grown.forget_grown();
  EXPECT_TRUE(grown.has_room());
}

}  // namespace
