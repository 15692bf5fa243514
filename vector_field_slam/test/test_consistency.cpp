// Accuracy and consistency over runs of rising distortion, simulated to the paper's odometry (26
// cm) and raw error (47 cm); tools/reproduce_vector_field_slam.sh has more of them.
#include <gtest/gtest.h>

#include "simulated_run.hpp"

using namespace vector_field_slam;
using simulation::Aligned;

namespace {

struct Summary {
  double mean = 0.0, inside = 0.0, nees = 0.0;
};

class Consistency : public ::testing::Test {
 protected:
  static constexpr int kRuns = 18;  // the nine of figure 8, twice

  static simulation::Room room(int run) {
    simulation::Room r;
    r.multipath = 0.7 * (run % 9) / 8.0;
    r.heading_noise = 0.024;
    r.rotation_noise = 0.015;
    r.translation_noise = 0.012;
    return r;
  }
  static void SetUpTestSuite() {
    for (int i = 0; i < kRuns; ++i) runs().push_back(simulation::simulate(room(i), 100 + 37 * i));
  }
  static std::vector<std::vector<simulation::Step>>& runs() {
    static std::vector<std::vector<simulation::Step>> all;
    return all;
  }
  static Summary over_runs(SolverType solver, Relocation relocation, int rings) {
    Summary s;
    for (int i = 0; i < kRuns; ++i) {
      auto p = simulation::params(room(i));
      p.solver = solver;
      p.relocation = relocation;
      p.recovery_rings = rings;
      const Aligned a = simulation::run(runs()[i], p).aligned;
      s.mean += a.mean / kRuns;
      s.inside += a.share_inside / kRuns;
      s.nees += a.nees / kRuns;
    }
    std::printf("mean %.2f cm, inside 90 %% ellipse %.1f %%, NEES %.2f\n", 100.0 * s.mean,
                100.0 * s.inside, s.nees);
    return s;
  }
};

TEST_F(Consistency, RunsAreThePapers) {
  double odometry = 0.0, raw = 0.0;
  for (int i = 0; i < kRuns; ++i) {
    std::vector<field_core::SE2> truth, reckoned;
    field_core::SE2 pose;
    for (const auto& s : runs()[i]) {
      pose = pose * s.odometry;
      truth.push_back(s.truth);
      reckoned.push_back(pose);
      const auto t = simulation::triangulate(room(i), s.z).translation();
      raw += (t - s.truth.translation()).norm() / static_cast<double>(runs()[i].size()) / kRuns;
    }
    odometry += simulation::align(truth, reckoned, {}).mean / kRuns;
  }
  EXPECT_NEAR(odometry, 0.26, 0.04);
  EXPECT_NEAR(raw, 0.47, 0.05);
}

// 54 runs of this kind (six seeds) gave 3.3 cm and 97 % for both, 3.6 cm and 95 % with
// shared_nodes, 5.4 cm and 96 % with the paper's relocation.
TEST_F(Consistency, DefaultIsAsGoodAsTheKalmanFilter) {
  const Summary ekf = over_runs(SolverType::ekf, Relocation::window, 1);
  const Summary eseif = over_runs(SolverType::eseif, Relocation::window, 1);
  EXPECT_LT(eseif.mean, 0.08);
  EXPECT_GT(eseif.mean, 0.015);  // better than the sensor allows: it has seen the truth
  EXPECT_LT(eseif.mean, 1.10 * ekf.mean);
  EXPECT_GT(eseif.inside, 0.80);
  EXPECT_LT(eseif.inside, 0.99);
  EXPECT_GT(eseif.nees, 0.5);
  EXPECT_LT(eseif.nees, 3.0);
}

/// A hall of 16 m, most of it new to the robot: what the linearization leaves out is no longer
/// small. 20 seeds: docs/results/vector_field_slam.md, (f).
TEST(Underweighting, KeepsAnExplorerHonest) {
  const auto explore = [](SolverType solver, double underweighting) {
    simulation::Room hall;
    hall.half_x = hall.half_y = hall.height = 8.0;
    hall.steps = 1000;
    hall.heading_noise = hall.rotation_noise = hall.translation_noise = 0.01;
    auto p = simulation::params(hall);
    p.solver = solver;
    p.underweighting = underweighting;
    constexpr int kRuns = 4;
    double error = 0.0, nees = 0.0;
    for (int seed = 1; seed <= kRuns; ++seed) {
      const auto outcome = simulation::run(simulation::simulate(hall, seed), p);
      error += outcome.unaligned / kRuns;
      nees += outcome.nees_unaligned / kRuns;
    }
    std::printf("unaligned %.2f m, NEES %.1f\n", error, nees);
    return std::make_pair(error, nees);
  };
  const auto linear = explore(SolverType::ekf, 0.0), ekf = explore(SolverType::ekf, 4.0),
             eseif = explore(SolverType::eseif, 4.0);
  EXPECT_LT(ekf.first, linear.first);
  EXPECT_GT(linear.second, 20.0);
  EXPECT_LT(ekf.second, 4.0);  // 2 is ideal
  EXPECT_GT(ekf.second, 0.5);
  EXPECT_LT(eseif.second,
            10.0);  // over-confident still: it knows no more than what its window does
  EXPECT_GT(eseif.second, 0.5);
}

TEST_F(Consistency, PapersRelocationIsWorse) {
  const Summary window = over_runs(SolverType::eseif, Relocation::window, 1);
  const Summary paper = over_runs(SolverType::eseif, Relocation::blank, 0);
  EXPECT_GT(paper.mean, 1.2 * window.mean);
  EXPECT_LT(paper.mean, 0.12);
}

}  // namespace
