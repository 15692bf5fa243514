// The model: interpolation, sensor models and extrapolation against formulas of their own, and
// every Jacobian against central differences.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <vector>

#include "field_core/errors.hpp"
#include "field_core/random.hpp"
#include "vector_field_slam/model.hpp"
#include "vector_field_slam/solver.hpp"
#include "vector_field_slam/underweighting.hpp"

using namespace vector_field_slam;

namespace {

constexpr int M = 4;
constexpr int kLocal = kRobot + 4 * M;
using Local = Eigen::Matrix<double, kLocal, 1>;

struct Kinds {
  const char* name;
  SensorModelType type;
  std::vector<std::string> channels;
};

VectorFieldSlamParams params_of(const Kinds& kinds) {
  VectorFieldSlamParams p;
  p.sensor_model = kinds.type;
  for (const auto& name : kinds.channels) p.channels[name].noise_stddev = 0.1;
  p.cell_size = 0.8;
  p.initial_pose_x = 0.3;
  p.initial_pose_y = -0.2;
  return p;
}

class Sensors : public ::testing::TestWithParam<Kinds> {
 protected:
  VectorFieldSlamParams params = params_of(GetParam());
  Model<M> model{params, make_channels(params)};
  Mounting<double> mounting{0.15, -0.07, 0.4};
  GridIndex cell{2, -1};

  ChannelPrediction<double> predict(const Local& local, int channel, double* row = nullptr) const {
    const double* nodes[4];
    for (int j = 0; j < 4; ++j) nodes[j] = local.data() + kRobot + j * M;
    const SensorPose<double> sensor(local.data(), mounting);
    const Interpolation<double> at(model.grid, cell, sensor.x, sensor.y);
    const auto p = model.sensor.predict(channel, sensor, local.data() + kPose, at, nodes);
    if (row) local_row<double, M>(p, at, channel, row);
    return p;
  }
  Local draw(field_core::Random& random) const {
    Local local;
    for (int i = 0; i < kLocal; ++i) local[i] = random.normal();
    local[0] = model.grid.node_x(cell) + random.uniform(0.0, 0.8);
    local[1] = model.grid.node_y(cell) + random.uniform(0.0, 0.8);
    return local;
  }
};

TEST_P(Sensors, JacobianEqualsDifferences) {
  field_core::Random random(7);
  for (int trial = 0; trial < 20; ++trial) {
    const Local local = draw(random);
    for (int channel = 0; channel < M; ++channel) {
      Local row;
      predict(local, channel, row.data());
      for (int i = 0; i < kLocal; ++i) {
        const double h = 1e-5;  // error of the difference: h^2 and 1e-16 / h, both below 1e-9
        Local plus = local, minus = local;
        plus[i] += h;
        minus[i] -= h;
        const double difference =
            (predict(plus, channel).value - predict(minus, channel).value) / (2.0 * h);
        EXPECT_NEAR(row[i], difference, 2e-8) << "channel " << channel << ", variable " << i;
      }
    }
  }
}

/// W of underweighting.hpp against differences of the rows of H.
TEST_P(Sensors, CurvatureEqualsDifferencesOfTheJacobian) {
  field_core::Random random(9);
  const Local local = draw(random);
  const double* nodes[4];
  for (int j = 0; j < 4; ++j) nodes[j] = local.data() + kRobot + j * M;
  const SensorPose<double> sensor(local.data(), mounting);
  const Interpolation<double> at(model.grid, cell, sensor.x, sensor.y);
  for (int channel = 0; channel < M; ++channel) {
    const Curvature<double, M> c(model.sensor, channel, sensor, at, nodes);
    Eigen::Matrix<double, kLocal, kLocal> w = w.Zero();
    for (int i = 0; i < kPose; ++i) {
      Local a;
      a << Eigen::Map<const RobotVector>(c.robot[i]),
          Eigen::Map<const Eigen::Matrix<double, 4 * M, 1>>(c.nodes[i]);
      w.row(i) += a.transpose();
      w.col(i) += a;
    }
    for (int i = 0; i < kLocal; ++i) {
      const double h = 1e-5;
      Local plus = local, minus = local, above, below;
      plus[i] += h;
      minus[i] -= h;
      predict(plus, channel, above.data());
      predict(minus, channel, below.data());
      EXPECT_LT(((above - below) / (2.0 * h) - w.col(i)).cwiseAbs().maxCoeff(), 2e-8)
          << "channel " << channel << ", variable " << i;
    }
  }
}

/// Against the matrices themselves.
TEST(Underweighting, VarianceIsHalfTheTraceOfTheSquare) {
  field_core::Random random(4);
  constexpr int n = 6;
  Eigen::Matrix<double, n, n> root, w = w.Zero();
  for (double& x : root.reshaped()) x = random.normal();
  const Eigen::Matrix<double, n, n> p = root * root.transpose();
  Eigen::Matrix<double, kPose, n> a, e = e.Identity();
  for (double& x : a.reshaped()) x = random.normal();
  for (int i = 0; i < kPose; ++i) {
    w += e.row(i).transpose() * a.row(i) + a.row(i).transpose() * e.row(i);
  }
  using Matrix = Eigen::Matrix<double, kPose, kPose, Eigen::RowMajor>;
  const Matrix ee = e * p * e.transpose(), ea = e * p * a.transpose(), aa = a * p * a.transpose();
  const auto rows = [](const Matrix& m) {
    return reinterpret_cast<const double(*)[kPose]>(m.data());
  };
  const double expected = 0.5 * (w * p * w * p).trace();
  EXPECT_NEAR((Curvature<double, 4>::variance(rows(ee), rows(ea), rows(aa))), expected,
              1e-12 * expected);
}

TEST_P(Sensors, FieldValueInvertsPredict) {
  field_core::Random random(8);
  const Local local = draw(random);
  const SensorPose<double> sensor(local.data(), mounting);
  const Interpolation<double> at(model.grid, cell, sensor.x, sensor.y);
  for (int channel = 0; channel < M; ++channel) {
    const int partner = model.sensor.channels[channel].partner;
    const double z = predict(local, channel).value;
    const double other = partner < 0 ? 0.0 : predict(local, partner).value;
    double expected = 0.0;
    for (int j = 0; j < 4; ++j) expected += at.w[j] * local[kRobot + j * M + channel];
    EXPECT_NEAR(
        model.sensor.field_value(channel, sensor, local.data() + kPose, at.x, at.y, z, other),
        expected, 1e-12);
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, Sensors,
    ::testing::Values(
        Kinds{"beacon_pairs", SensorModelType::beacon_pairs, {"a_x", "a_y", "b_x", "b_y"}},
        Kinds{"scalar", SensorModelType::scalar, {"a", "b", "c", "d"}},
        Kinds{"magnetic", SensorModelType::magnetic, {"mag_norm", "mag_x", "mag_y", "mag_z"}},
        Kinds{"range", SensorModelType::range, {"r1", "r2", "r3", "r4"}}),
    [](const auto& info) { return std::string(info.param.name); });

TEST(Grid, CellsAndNodes) {
  const GridGeometry<double> grid{0.5, 1.0, -2.0};
  GridIndex cell;
  ASSERT_TRUE(grid.cell_of(1.0, -2.0, cell));
  EXPECT_EQ(cell, (GridIndex{0, 0}));
  ASSERT_TRUE(grid.cell_of(0.999, -1.2, cell));
  EXPECT_EQ(cell, (GridIndex{-1, 1}));
  EXPECT_EQ(cell_node(cell, 3), (GridIndex{0, 2}));
  EXPECT_DOUBLE_EQ(grid.node_x(cell_node(cell, 1)), 1.0);
  EXPECT_FALSE(grid.cell_of(1e9, 0.0, cell));
  EXPECT_FALSE(grid.cell_of(std::nan(""), 0.0, cell));
  const auto centred = GridGeometry<double>::around(3.0, 4.0, 2.0);
  EXPECT_DOUBLE_EQ(centred.node_x({0, 0}), 2.0);
  EXPECT_DOUBLE_EQ(centred.node_y({0, 0}), 3.0);
}

TEST(Bilinear, IsOneAtItsNodeAndLinearOnEdges) {
  const GridGeometry<double> grid{2.0, 0.0, 0.0};
  const GridIndex cell{1, 3};
  for (int j = 0; j < 4; ++j) {
    const GridIndex n = cell_node(cell, j);
    const Interpolation<double> at(grid, cell, grid.node_x(n), grid.node_y(n));
    for (int k = 0; k < 4; ++k) EXPECT_DOUBLE_EQ(at.w[k], j == k ? 1.0 : 0.0);
  }
  const Interpolation<double> at(grid, cell, 2.5, 7.5);  // a quarter right, three quarters up
  EXPECT_DOUBLE_EQ(at.w[0], 0.75 * 0.25);
  EXPECT_DOUBLE_EQ(at.w[1], 0.25 * 0.25);
  EXPECT_DOUBLE_EQ(at.w[2], 0.75 * 0.75);
  EXPECT_DOUBLE_EQ(at.w[3], 0.25 * 0.75);
}

TEST(BeaconPairs, EquationFortySeven) {
  const Kinds kinds{"", SensorModelType::beacon_pairs, {"s1_x", "s1_y", "s2_x", "s2_y"}};
  const auto params = params_of(kinds);
  const Model<M> model(params, make_channels(params));
  const double robot[kRobot] = {0.2, -0.3, 1.1, 0.03, -0.02};
  const double values[M] = {0.5, -0.4, 0.2, 0.9};  // the same at all four nodes
  const double* nodes[4] = {values, values, values, values};
  const SensorPose<double> sensor(robot, {});
  const Interpolation<double> at(model.grid, {0, 0}, sensor.x, sensor.y);
  Eigen::Matrix4d rotation = Eigen::Matrix4d::Zero();
  rotation.topLeftCorner<2, 2>() << std::cos(1.1), std::sin(1.1), -std::sin(1.1), std::cos(1.1);
  rotation.bottomRightCorner<2, 2>() = rotation.topLeftCorner<2, 2>();
  const Eigen::Vector4d expected = rotation * Eigen::Map<const Eigen::Vector4d>(values) +
                                   Eigen::Vector4d(0.03, -0.02, 0.03, -0.02);
  for (int i = 0; i < M; ++i) {
    EXPECT_NEAR(model.sensor.predict(i, sensor, robot + kPose, at, nodes).value, expected[i],
                1e-14);
  }
}

/// Mean and variance of the squares of noisy ranges, by drawing them.
TEST(Range, SquaresHaveTheTrueMeanAndVariance) {
  field_core::Random random(9);
  const double range = 3.0, stddev = 0.8;
  constexpr int kDraws = 200000;
  double sum = 0.0, squares = 0.0, variance = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    const auto z =
        as_observation(0, ChannelKind::range, range + random.normal(0.0, stddev), stddev * stddev);
    sum += z.value / kDraws;
    squares += z.value * z.value / kDraws;
    variance += z.variance / kDraws;
  }
  const double spread = squares - sum * sum;
  EXPECT_NEAR(sum, range * range, 4.0 * std::sqrt(spread / kDraws));
  // The reading stands for the true range in the variance: too large by 4 q^2 on average.
  EXPECT_NEAR(variance, spread + 4.0 * std::pow(stddev, 4), 0.02 * spread);
}

TEST(Range, BilinearNodesAreExactForAnyBeacon) {
  const auto params = params_of({"", SensorModelType::range, {"r1", "r2", "r3", "r4"}});
  const Model<M> model(params, make_channels(params));
  const Eigen::Vector2d beacon(7.0, -3.0);  // relative to node (0, 0)
  double values[4][M] = {};
  const double* nodes[4];
  for (int j = 0; j < 4; ++j) {
    const GridIndex n = cell_node({0, 0}, j);
    const Eigen::Vector2d at(params.cell_size * n.x, params.cell_size * n.y);
    values[j][0] = beacon.squaredNorm() - 2.0 * beacon.dot(at);
    nodes[j] = values[j];
  }
  const double robot[kRobot] = {model.grid.origin_x + 0.3, model.grid.origin_y + 0.6, 0, 0, 0};
  const SensorPose<double> sensor(robot, {});
  const Interpolation<double> at(model.grid, {0, 0}, sensor.x, sensor.y);
  const auto p = model.sensor.predict(0, sensor, robot + kPose, at, nodes);
  EXPECT_NEAR(p.value, (beacon - Eigen::Vector2d(0.3, 0.6)).squaredNorm(), 1e-12);
}

TEST(Odometry, JacobianAndInverseOfEquationFortyNine) {
  const field_core::OdometryMotionModel model({0.1, 0.02, 0.05, 0.01});
  const field_core::SE2 pose(1.0, 2.0, 0.7), delta(0.4, -0.1, 0.3);
  const auto step = odometry_step(model, pose, delta);
  double g[3][3], inverse[3][3];
  step.jacobian(g);
  step.inverse_jacobian(inverse);
  const Eigen::Matrix3d product = Eigen::Map<Eigen::Matrix3d>(&inverse[0][0]).transpose() *
                                  Eigen::Map<Eigen::Matrix3d>(&g[0][0]).transpose();
  EXPECT_LT((product - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), 1e-15);
  const double h = 1e-6;
  for (int i = 0; i < 3; ++i) {
    Eigen::Vector3d plus = pose.vector(), minus = pose.vector();
    plus[i] += h;
    minus[i] -= h;
    const Eigen::Vector3d column =
        ((field_core::SE2(plus) * delta).vector() - (field_core::SE2(minus) * delta).vector()) /
        (2.0 * h);
    for (int r = 0; r < 3; ++r) EXPECT_NEAR(g[r][i], column[r], 1e-9);
  }
}

TEST(Odometry, StepAndNoiseAreThoseOfTheMotionModel) {
  const field_core::OdometryMotionModel model({0.1, 0.02, 0.05, 0.01});
  const field_core::SE2 pose(1.0, 2.0, 3.0), delta(0.4, 0.2, 0.5);
  const auto step = odometry_step(model, pose, delta);
  const field_core::SE2 after = pose * delta;
  EXPECT_NEAR(pose.x() + step.dx, after.x(), 1e-14);
  EXPECT_NEAR(pose.y() + step.dy, after.y(), 1e-14);
  EXPECT_NEAR(field_core::wrap_angle(pose.yaw() + step.dyaw), after.yaw(), 1e-14);
  // Two thousand samples: the sample covariance is within 5 standard errors (0.032 each way).
  field_core::Random random(3);
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero(), noise;
  const int n = 20000;
  for (int i = 0; i < n; ++i) {
    const auto sampled = model.sample(pose, field_core::OdometryMotion::from(delta), random);
    Eigen::Vector3d e = sampled.vector() - after.vector();
    e.z() = field_core::wrap_angle(e.z());
    sum += e * e.transpose() / n;
  }
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) noise(i, j) = step.noise[i][j];
  }
  EXPECT_LT((sum - noise).norm(), 0.1 * noise.norm());
}

TEST(Extrapolation, EquationFortyEight) {
  const Channel channels[M] = {{ChannelKind::planar_x, 1},
                               {ChannelKind::planar_y, 0},
                               {ChannelKind::planar_x, 3},
                               {ChannelKind::planar_y, 2}};
  const ExtrapolationFactors<double, M> factors(channels, Extrapolation::common);
  Eigen::Matrix4d a1, a2;  // as printed
  a1 << 1, 0, 1, 0, 0, 1, 0, 1, 1, 0, 1, 0, 0, 1, 0, 1;
  a1 *= -0.5;
  a2 << 3, 0, 1, 0, 0, 3, 0, 1, 1, 0, 3, 0, 0, 1, 0, 3;
  a2 *= 0.5;
  const Eigen::Vector4d far(0.3, -0.2, 0.8, 0.1), near(0.5, 0.4, -0.6, 0.7);
  Eigen::Vector4d result;
  factors.extrapolate(far.data(), near.data(), result.data());
  EXPECT_LT((result - (a1 * far + a2 * near)).cwiseAbs().maxCoeff(), 1e-15);
}

TEST(Extrapolation, LinearContinuesTheLine) {
  const Channel channels[2] = {{}, {}};
  const ExtrapolationFactors<double, 2> factors(channels, Extrapolation::linear);
  const double far[2] = {1.0, 5.0}, near[2] = {2.0, 3.0};
  double result[2];
  factors.extrapolate(far, near, result);
  EXPECT_DOUBLE_EQ(result[0], 3.0);
  EXPECT_DOUBLE_EQ(result[1], 1.0);
}

TEST(Extrapolation, StraightLinesBeforeDiagonals) {
  const std::vector<GridIndex> known = {{0, 0}, {1, 0}, {0, 1}, {1, 1}, {2, 2}};
  const auto find = [&](GridIndex i) {
    for (std::size_t k = 0; k < known.size(); ++k) {
      if (known[k] == i) return static_cast<int>(k);
    }
    return -1;
  };
  auto source = extrapolation_source({2, 0}, find);
  EXPECT_EQ(source.near, 1);
  EXPECT_EQ(source.far, 0);
  source = extrapolation_source({-1, -1}, find);
  EXPECT_EQ(source.near, 0);
  EXPECT_EQ(source.far, 3);
  EXPECT_EQ(extrapolation_source({0, 5}, find).near, -1);
}

TEST(LinearStart, FindsThePlaneAmongOutliers) {
  field_core::Random random(5);
  std::vector<FieldSample<double>> samples;
  for (int i = 0; i < 20; ++i) {
    const double x = random.uniform(-1, 1), y = random.uniform(-1, 1);
    const double gross = i % 4 == 0 ? 5.0 : 0.0;
    samples.push_back({x, y, 2.0 - x + 0.5 * y + gross + random.normal(0.0, 0.01), 0.01});
  }
  const auto f = LinearStart<double>::fit(samples.data(), 20, 10.0);
  // 15 samples of noise 0.01 and spread 0.6: standard errors of 0.003 in value and 0.005 in slope.
  EXPECT_NEAR(f.at(0.0, 0.0), 2.0, 0.015);
  EXPECT_NEAR(f.slope_x, -1.0, 0.025);
  EXPECT_NEAR(f.slope_y, 0.5, 0.025);
}

TEST(LinearStart, OnePlaceGivesNoSlope) {
  std::vector<FieldSample<double>> samples(5, {1.0, 2.0, 7.0, 0.1});
  const auto f = LinearStart<double>::fit(samples.data(), 5, 1.0);
  EXPECT_DOUBLE_EQ(f.slope_x, 0.0);
  EXPECT_DOUBLE_EQ(f.at(9.0, 9.0), 7.0);
}

TEST(Channels, VectorsNeedBothAxes) {
  auto params = params_of({"", SensorModelType::magnetic, {"mag_x", "mag_z"}});
  EXPECT_THROW(make_channels(params), field_core::ParameterError);
  params.channels["mag_y"];
  const auto channels = make_channels(params);
  EXPECT_EQ(channels[0].role.partner, 1);
  EXPECT_EQ(channels[1].role.partner, 0);
  EXPECT_EQ(channels[2].role.kind, ChannelKind::scalar);
  EXPECT_NO_THROW(params.validate());
  params.sensor_model = SensorModelType::beacon_pairs;
  EXPECT_THROW(params.validate(), field_core::ParameterError);
}

}  // namespace
