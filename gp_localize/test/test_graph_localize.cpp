// The particle filter on a graph against exact filters, and the traffic experiment's world.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <filesystem>

#include "../src/traffic_network.hpp"
#include "field_core/csv.hpp"
#include "field_core/errors.hpp"
#include "gp_localize/graph_localize.hpp"

using namespace gp_localize;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kNoise = 0.3;

/// Two loops that share a street: turns matter.
Graph town() {
  return {7,
          {{0, 1, 1.0},
           {1, 2, 1.0},
           {2, 3, 1.5},
           {3, 0, 1.0},
           {2, 4, 2.0},
           {4, 5, 1.0},
           {5, 6, 1.0},
           {6, 3, 1.0}}};
}

GraphMotion traffic() {
  GraphMotion motion(town());
  motion.learn({0, 1, 2, 4, 4, 5, 6, 3, 0, 1, 1, 2, 3, 6, 5, 4, 2, 3, 0, 1, 2, 4});
  return motion;
}

struct Town {
  GraphMotion motion = traffic();
  field_core::Places places = embed(distances(motion.graph()), 3);
  FieldModel field = model(places);

  static FieldModel model(const field_core::Places& places) {
    const field_core::Kernel kernel(field_core::KernelType::matern52, 1.5,
                                    Eigen::Vector3d(1.0, 1.2, 0.9));
    return {{"speed", "mph"}, 20.0, kNoise * kNoise, SupportBasis(kernel, places, 1e-8, 0.0)};
  }
  GraphWorld world() const { return {motion, places, field}; }
};

GpLocalizeParams params(int particles) {
  GpLocalizeParams p;
  p.particles = particles;
  p.likelihood_noise_scale = 1.0;
  p.precision = Precision::double_precision;
  return p;
}

double total_variation(const VectorXd& a, const VectorXd& b) {
  return 0.5 * (a - b).cwiseAbs().sum();
}

const std::vector<double> kReadings = {20.9, 19.2, 21.4, 18.8, 19.9, 21.0, 19.5, 20.3};

/// 20,000 particles: a probability has a standard deviation of 0.0035, and resampling adds to it.
constexpr int kMany = 20000;

TEST(GraphLocalize, OnAKnownMapIsTheForwardFilter) {
  const Town town;
  Eigen::Matrix2Xd known(2, 7);
  known << 20.5, 19.5, 21.0, 18.9, 19.1, 20.8, 19.9, 0.1, 0.2, 0.1, 0.3, 0.1, 0.1, 0.2;
  GraphLocalize filter(params(kMany), town.world(), known, 3);
  const VectorXd start = VectorXd::Constant(7, 1.0 / 7.0);
  GraphForwardFilter exact(town.motion, start);
  filter.start(start);
  for (const double reading : kReadings) {
    filter.predict();
    exact.predict();
    ASSERT_TRUE(filter.update(reading).applied);
    const VectorXd variance = known.row(1).transpose().array() + kNoise * kNoise;
    const VectorXd error = known.row(0).transpose().array() - reading;
    exact.update(-0.5 * (error.array().square() / variance.array() + variance.array().log()));
    EXPECT_LT(total_variation(filter.belief(), exact.belief()), 0.02);
  }
}

/// The forward filter itself, by the sum over all sequences of arcs.
TEST(GraphLocalize, TheForwardFilterSumsOverAllPaths) {
  const Town town;
  const Graph& g = town.motion.graph();
  const VectorXd start = VectorXd::Unit(7, 2);
  GraphForwardFilter filter(town.motion, start);
  const VectorXd likelihood = VectorXd::LinSpaced(7, -2.0, 1.0);
  filter.predict();
  filter.update(likelihood);
  filter.predict();
  const auto step = [&](int from, int to) {
    const int node = g.head(from);
    double p = from == to ? town.motion.hold(node) : 0.0;
    for (std::size_t k = 0; k < g.leaving(node).size(); ++k) {
      if (g.leaving(node)[k] != to) continue;
      p += (1.0 - town.motion.hold(node)) * town.motion.turns(from)[static_cast<Eigen::Index>(k)];
    }
    return p;
  };
  VectorXd expected = VectorXd::Zero(7);
  for (int a = 0; a < g.arcs(); ++a) {
    if (g.head(a) != 2) continue;
    for (int b = 0; b < g.arcs(); ++b) {
      for (int c = 0; c < g.arcs(); ++c) {
        expected[g.head(c)] += step(a, b) * std::exp(likelihood[g.head(b)]) * step(b, c);
      }
    }
  }
  EXPECT_LT(total_variation(filter.belief(), expected / expected.sum()), 1e-14);
}

/// All paths of `length` steps with their probability times the density that a dense Gaussian
/// process gives their readings; summed up by the last node.
class Enumeration {
 public:
  Enumeration(const Town& town, int length) : town_(town), length_(length) {
    for (const int leaving : town.motion.graph().leaving(0)) {
      const int arc = leaving ^ 1;
      walk(arc, 1.0 / static_cast<double>(town.motion.graph().leaving(0).size()), {0});
    }
    belief_ /= belief_.sum();
  }
  const VectorXd& belief() const { return belief_; }

 private:
  void walk(int arc, double probability, std::vector<int> nodes) {
    const GraphMotion& motion = town_.motion;
    if (static_cast<int>(nodes.size()) == length_) {
      belief_[nodes.back()] += probability * density(nodes);
      return;
    }
    const int node = motion.graph().head(arc);
    const auto go_on = [&](int next, double p) {
      std::vector<int> longer = nodes;
      longer.push_back(motion.graph().head(next));
      walk(next, probability * p, longer);
    };
    go_on(arc, motion.hold(node));
    for (std::size_t k = 0; k < motion.graph().leaving(node).size(); ++k) {
      go_on(motion.graph().leaving(node)[k],
            (1.0 - motion.hold(node)) * motion.turns(arc)[static_cast<Eigen::Index>(k)]);
    }
  }
  /// Matern 5/2 by its formula.
  double density(const std::vector<int>& nodes) const {
    const auto n = static_cast<Eigen::Index>(nodes.size());
    MatrixXd sigma(n, n);
    VectorXd error(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      error[i] = kReadings[i] - 20.0;
      for (Eigen::Index j = 0; j < n; ++j) {
        const Eigen::Vector3d d = (town_.places.col(nodes[i]) - town_.places.col(nodes[j]))
                                      .cwiseQuotient(Eigen::Vector3d(1.0, 1.2, 0.9));
        const double r = std::sqrt(5.0) * d.norm();
        sigma(i, j) = 1.5 * 1.5 * (1.0 + r + r * r / 3.0) * std::exp(-r);
      }
      sigma(i, i) += kNoise * kNoise;
    }
    return std::exp(-0.5 * error.dot(sigma.ldlt().solve(error))) / std::sqrt(sigma.determinant());
  }

  const Town& town_;
  int length_;
  VectorXd belief_ = VectorXd::Zero(7);
};

VectorXd belief_after(const Town& town, const GpLocalizeParams& p, int length) {
  GraphLocalize filter(p, town.world(), 17);
  filter.start(VectorXd::Unit(7, 0));
  for (int step = 0; step < length; ++step) {
    if (step > 0) filter.predict();
    EXPECT_TRUE(filter.update(kReadings[step]).applied);
  }
  return filter.belief();
}

TEST(GraphLocalize, AMapPerParticleIsTheSumOverAllPaths) {
  const Town town;
  for (const int length : {2, 4, 6}) {
    const VectorXd exact = Enumeration(town, length).belief();
    GpLocalizeParams p = params(kMany);
    p.slice_size = 10;  // never full: the open slice is exact
    EXPECT_LT(total_variation(belief_after(town, p, length), exact), 0.03) << length;
    p.observation_model = ObservationModelType::full_gp;
    EXPECT_LT(total_variation(belief_after(town, p, length), exact), 0.03) << length;
    // Support at every node leaves nothing open: slices of two are exact too.
    p.observation_model = ObservationModelType::online_pitc;
    p.slice_size = 2;
    EXPECT_LT(total_variation(belief_after(town, p, length), exact), 0.03) << length;
    p.observation_model = ObservationModelType::sod_truncate;  // and two readings are not
    p.subset_size = 2;
    const double truncated = total_variation(belief_after(town, p, length), exact);
    EXPECT_TRUE(length < 6 || truncated > 0.03) << truncated;
  }
}

/// Eq. (9) after one reading at a known node: all sample paths have the same map, and so has every
/// particle; until then the two kinds of hypotheses agree.
TEST(GraphLocalize, SamplePathsStartWithWhatAMapPerParticleHas) {
  const Town town;
  GpLocalizeParams own = params(kMany), shared = own;
  shared.map_hypotheses = MapHypotheses::sample_paths;
  shared.sample_paths = 30;
  for (const auto model : {ObservationModelType::online_pitc, ObservationModelType::sod_even}) {
    own.observation_model = shared.observation_model = model;
    EXPECT_LT(total_variation(belief_after(town, shared, 2), belief_after(town, own, 2)), 0.02);
  }
}

TEST(GraphLocalize, EveryModelRunsAndRepeatsItself) {
  const Town town;
  for (const auto hypotheses : {MapHypotheses::particle, MapHypotheses::sample_paths}) {
    for (const auto model :
         {ObservationModelType::online_pitc, ObservationModelType::online_pitc_assimilated,
          ObservationModelType::offline_pitc, ObservationModelType::fitc,
          ObservationModelType::full_gp, ObservationModelType::sod_truncate,
          ObservationModelType::sod_even}) {
      GpLocalizeParams p = params(50);
      p.map_hypotheses = hypotheses;
      p.observation_model = model;
      p.sample_paths = 20;
      p.slice_size = 3;
      p.subset_size = 4;
      if (hypotheses == MapHypotheses::particle && model == ObservationModelType::offline_pitc) {
        EXPECT_THROW(GraphLocalize(p, town.world(), 1), field_core::ParameterError);
        continue;
      }
      const VectorXd belief = belief_after(town, p, 8);
      EXPECT_NEAR(belief.sum(), 1.0, 1e-12);
      EXPECT_EQ(belief, belief_after(town, p, 8));
    }
  }
}

class TrafficFiles : public ::testing::Test {
 protected:
  TrafficFiles() : folder(std::filesystem::temp_directory_path() / "field_traffic_files") {
    std::filesystem::create_directories(folder);
    write("sensors.csv", "k,x_m,y_m\n0,0,0\n1,900,0\n2,1800,0\n3,9000,0\n");
    // 900 m: exp(-(900/2600)^2); 1800 m with a detour over sensor 1; sensor 3 is apart.
    write("edges.csv", "from_k,to_k,w\n0,1,0.88707\n1,0,0.88707\n1,2,0.88707\n0,2,0.61922\n");
    write("speed_mph_10min.csv", "minute,k0,k1,k2,k3\n0,60,50,40,30\n10,61,51,41,31\n");
  }
  ~TrafficFiles() override { std::filesystem::remove_all(folder); }
  void write(const std::string& name, const std::string& text) {
    field_core::write_file_atomically((folder / name).string(), text);
  }
  std::string error() {
    try {
      read_traffic_network(folder.string());
    } catch (const field_core::DataError& e) {
      return e.what();
    }
    return "no error";
  }
  std::filesystem::path folder;
};

TEST_F(TrafficFiles, AreReadAsANetwork) {
  const TrafficNetwork n = read_traffic_network(folder.string());
  EXPECT_EQ(n.sensors, (std::vector<int>{0, 1, 2}));
  ASSERT_EQ(n.graph.edges().size(), 2u);
  EXPECT_NEAR(n.graph.length(0), 900.0, 0.1);
  EXPECT_EQ(n.speeds(row_at(n, 0, 10.0), 2), 41.0);
  EXPECT_THROW(row_at(n, 1, 0.0), field_core::DataError);
}

TEST_F(TrafficFiles, ThatAreWrongAreNamedByFileAndLine) {
  const auto says = [&](const std::string& file, const std::string& text, const char* what) {
    const std::string before = field_core::read_file((folder / file).string());
    write(file, text);
    EXPECT_NE(error().find(file), std::string::npos) << error();
    EXPECT_NE(error().find(what), std::string::npos) << error();
    write(file, before);
  };
  says("edges.csv", "from_k,to_k,w\n0,1,0.9\n0,4,0.9\n", "3: names a sensor that does not exist");
  says("edges.csv", "from_k,to_k,w\n0,1,1.5\n", "2: w must be");
  says("edges.csv", "from_k,to_k,w\n0,0.5,0.5\n", "2: '0.5' is not the number of a sensor");
  says("edges.csv", "from,to_k,w\n", "from_k");
  says("sensors.csv", "k,x_m,y_m\n0,0,0\n2,900,0\n", "3: sensor 2 where 1 is expected");
  says("speed_mph_10min.csv", "minute,k0,k1,k2,k3\n0,60,0,40,30\n", "2: column 'k1'");
  says("speed_mph_10min.csv", "minute,k0,k2,k3\n0,60,40,30\n", "k1");
  std::filesystem::remove(folder / "sensors.csv");
  EXPECT_NE(error().find("sensors.csv"), std::string::npos);
}

/// Neighbours only, and at 60 mph 900 m take half a minute: one report each.
TEST_F(TrafficFiles, VehiclesDriveAlongEdges) {
  const TrafficNetwork n = read_traffic_network(folder.string());
  field_core::Random random(1);
  const auto fast = drive(n.graph, VectorXd::Constant(3, 60.0), {200, 60.0}, random);
  const auto slow = drive(n.graph, VectorXd::Constant(3, 10.0), {200, 60.0}, random);
  ASSERT_EQ(fast.size(), 200u);
  int held_fast = 0, held_slow = 0;
  for (std::size_t i = 1; i < fast.size(); ++i) {
    EXPECT_LE(std::abs(fast[i] - fast[i - 1]), 1);
    held_fast += fast[i] == fast[i - 1];
    held_slow += slow[i] == slow[i - 1];
  }
  EXPECT_EQ(held_fast, 0);
  EXPECT_GT(held_slow, 100);  // 900 m at 10 mph: 3.4 minutes
}

}  // namespace
