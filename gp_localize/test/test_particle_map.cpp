// A map per particle, through resampling, against dense regression along every particle's own path.
#include <gtest/gtest.h>

#include <cmath>

#include "../src/particle_map.hpp"
#include "dense_reference.hpp"

using namespace gp_localize;
using field_core::SE2;

namespace {

constexpr int kParticles = 9, kSlice = 4;

GpLocalizeParams params() {
  GpLocalizeParams p;
  FieldParams light, heat;
  light.signal_stddev = 1.4;
  light.noise_stddev = 0.3;
  light.length_scales = {1.5, 2.0};
  heat.kernel = field_core::KernelType::matern52;
  heat.length_scales = {3.0, 2.5};
  p.fields = {{"light", light}, {"heat", heat}};
  p.particles = kParticles;
  p.slice_size = kSlice;
  p.map_hypotheses = MapHypotheses::particle;
  p.support.region = {-3.0, -3.0, 3.0, 3.0};
  p.support.size = 16;
  p.support.jitter = 1e-6;
  return p;
}

/// What one particle has been through: places and values per field, and the slice of each.
struct History {
  std::vector<Eigen::Vector2d> places[2];
  std::vector<double> values[2];
  std::vector<int> slices[2];
};

class ParticleMapTest : public ::testing::Test {
 protected:
  ParticleMapTest() : p(params()), models(make_field_models(p)), map(p, models), random(3) {
    particles.resize(kParticles);
    for (Particle& particle : particles) particle.weight = 1.0 / kParticles;
    histories.resize(kParticles);
  }

  test::Moments dense(int particle, int field, const Eigen::Vector2d& query, int slice) const {
    const auto& basis = models[field].basis;
    const test::DenseField d{basis.kernel(), basis.support(),
                             p.support.jitter * basis.kernel().signal_variance(),
                             models[field].noise_variance};
    const History& h = histories[particle];
    const auto n = static_cast<Eigen::Index>(h.values[field].size());
    if (n == 0) return {0.0, basis.kernel().signal_variance()};
    Eigen::Matrix2Xd x(2, n);
    for (Eigen::Index i = 0; i < n; ++i) x.col(i) = h.places[field][i];
    return test::block_regression(d, x,
                                  Eigen::Map<const Eigen::VectorXd>(h.values[field].data(), n),
                                  h.slices[field], query, slice);
  }

  std::vector<Observation> observe() {
    std::vector<Observation> all;
    for (int f = 0; f < 2; ++f) {
      if (f == 0 && step % 3 == 1) continue;  // one field is missing at times
      const double noise = models[f].noise_variance;
      all.push_back({f, random.normal(), noise, 4.0 * noise});
    }
    return all;
  }

  void move_and_weigh(const std::vector<Observation>& observations) {
    for (Particle& particle : particles) {
      particle.pose = SE2(particle.pose.vector() +
                          0.4 * Eigen::Vector3d(random.normal(), random.normal(), 0.0));
    }
    std::vector<double> log_likelihood;
    Innovation innovation;
    map.weigh(particles, SE2(), observations, log_likelihood, innovation);
    for (int i = 0; i < kParticles; ++i) {
      double expected = 0.0;
      for (const Observation& o : observations) {
        const auto m = dense(i, o.field, particles[i].pose.translation(), step / kSlice);
        const double variance = m.variance + o.likelihood_variance;
        expected -= 0.5 * (std::pow(o.value - m.mean, 2) / variance + std::log(variance));
      }
      // Condition 1e6 of the support: 1e-10 in moments, times error / variance up to 30.
      EXPECT_NEAR(log_likelihood[i], expected, 1e-8) << "particle " << i << ", step " << step;
    }
  }

  void learn(const std::vector<Observation>& observations) {
    map.learn(particles, SE2(), observations, random);
    for (int i = 0; i < kParticles; ++i) {
      for (const Observation& o : observations) {
        histories[i].places[o.field].push_back(particles[i].pose.translation());
        histories[i].values[o.field].push_back(o.value);
        histories[i].slices[o.field].push_back(step / kSlice);
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
    map.resampled(ancestors);
  }

  GpLocalizeParams p;
  std::vector<FieldModel> models;
  ParticleMap map;
  field_core::Random random;
  ParticleSet particles;
  std::vector<History> histories;
  int step = 0;
};

TEST_F(ParticleMapTest, EveryParticleKnowsItsOwnPath) {
  for (int i = 0; i < 15; ++i) {
    const auto observations = observe();
    move_and_weigh(observations);
    learn(observations);
    if (i % 2 == 0 || i % 7 == 0) resample();  // within slices and at their ends
  }
  EXPECT_LE(map.distinct_maps(), kParticles);
}

TEST_F(ParticleMapTest, PredictsTheMixtureOfTheParticles) {
  for (int i = 0; i < 6; ++i) {
    const auto observations = observe();
    move_and_weigh(observations);
    learn(observations);
    if (i == 3) resample();
  }
  particles[2].weight *= 2.0;
  for (Particle& particle : particles) particle.weight /= 1.0 + 1.0 / kParticles;
  const Eigen::Vector2d query(0.3, -0.8);
  for (int f = 0; f < 2; ++f) {
    Eigen::VectorXd mean, variance;
    map.predict(f, query, particles, mean, variance);
    double m = 0.0, square = 0.0;
    for (int i = 0; i < kParticles; ++i) {
      const auto d = dense(i, f, query, step / kSlice);
      m += particles[i].weight * d.mean;
      square += particles[i].weight * (d.variance + d.mean * d.mean);
    }
    EXPECT_NEAR(mean[0], m, 1e-9);
    EXPECT_NEAR(variance[0], square - m * m, 1e-9);
  }
}

TEST(ParticleMapOutliers, DensityIsTheMixture) {
  GpLocalizeParams p = params();
  p.outlier_share = 0.2;
  const auto models = make_field_models(p);
  ParticleMap map(p, models);
  ParticleSet particles(kParticles);
  for (const double value : {0.1, 3.0, 60.0}) {
    std::vector<double> log_likelihood;
    Innovation innovation;
    map.weigh(particles, SE2(), {{1, value, 0.09, 0.36}}, log_likelihood, innovation);
    const double v = 1.4 * 1.4 + 0.36, wide = v + 1.4 * 1.4;  // nothing is known yet
    const double expected = std::log(0.8 / std::sqrt(v) * std::exp(-0.5 * value * value / v) +
                                     0.2 / std::sqrt(wide) * std::exp(-0.5 * value * value / wide));
    EXPECT_NEAR(log_likelihood[3], expected, 1e-9 * (1.0 + std::abs(expected)));
  }
}

TEST_F(ParticleMapTest, SharesWhatClosedSlicesSay) {
  EXPECT_EQ(map.distinct_maps(), 1);  // the prior
  for (int i = 0; i < kSlice; ++i) {
    const auto observations = observe();
    move_and_weigh(observations);
    learn(observations);
    EXPECT_EQ(map.distinct_maps(), i + 1 < kSlice ? 1 : kParticles);
  }
  map.resampled(std::vector<int>(kParticles, 4));
  EXPECT_EQ(map.distinct_maps(), 1);
}

}  // namespace
