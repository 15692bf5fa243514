#include "vector_field_slam/relocalization.hpp"

#include <algorithm>
#include <cmath>

namespace vector_field_slam {

using field_core::SE2;

namespace {

/// Readings at neighbouring times share their errors (interpolation, the map's): a likelihood as
/// sharp as their noise would pick one particle too early.
constexpr double kTempering = 0.25;
/// A reading at a place without a map explains nothing: as unlikely as 5 standard deviations.
constexpr double kUnknownPlace = 12.5;

}  // namespace

Relocalization::Relocalization(const std::vector<ChannelModel>& channels,
                               const GridGeometry<double>& grid,
                               const field_core::OdometryMotionModel& motion, int particles)
    : sensor_(any_sensor(channels)), grid_(grid), motion_(motion), wanted_(particles) {}

bool Relocalization::scatter(const Solver& map, field_core::Random& random) {
  std::vector<GridIndex> cells;
  for (int i = 0; i < map.node_count(); ++i) {
    const GridIndex cell = map.node_index(i);
    bool known = true;
    for (int j = 1; j < 4; ++j) known = known && map.find(cell_node(cell, j)) >= 0;
    if (known) cells.push_back(cell);
  }
  particles_.clear();
  if (cells.empty()) return false;
  for (int k = 0; k < wanted_; ++k) {
    const GridIndex cell = cells[random.index(cells.size())];
    particles_.push_back({SE2(grid_.node_x(cell) + random.uniform(0.0, grid_.cell_size),
                              grid_.node_y(cell) + random.uniform(0.0, grid_.cell_size),
                              random.uniform(-M_PI, M_PI)),
                          1.0 / wanted_});
  }
  resampled_ = particles_;
  return true;
}

void Relocalization::move(const SE2& delta, field_core::Random& random) {
  const auto motion = field_core::OdometryMotion::from(delta);
  for (auto& p : particles_) p.pose = motion_.sample(p.pose, motion, random);
}

double Relocalization::log_likelihood(const Solver& map, const SE2& pose,
                                      const Mounting<double>& mounting,
                                      const Observation<double>* observations, int count) const {
  const double robot[kRobot] = {pose.x(), pose.y(), pose.yaw(), map.robot()[3], map.robot()[4]};
  const SensorPose<double> sensor(robot, mounting);
  GridIndex cell;
  const double* values[4];
  bool known = grid_.cell_of(sensor.x, sensor.y, cell);
  for (int j = 0; j < 4 && known; ++j) {
    const int node = map.find(cell_node(cell, j));
    known = node >= 0;
    if (known) values[j] = map.node_values(node);
  }
  if (!known) return -kUnknownPlace * count;
  const Interpolation<double> at(grid_, cell, sensor.x, sensor.y);
  double sum = 0.0;
  for (int k = 0; k < count; ++k) {
    const auto p = sensor_.predict(observations[k].channel, sensor, robot + kPose, at, values);
    const double error = observations[k].value - p.value;
    sum -= std::min(0.5 * error * error / observations[k].variance, kUnknownPlace);
  }
  return sum;
}

std::optional<field_core::Belief> Relocalization::observe(const Solver& map,
                                                          const Mounting<double>& mounting,
                                                          const Observation<double>* observations,
                                                          int count, field_core::Random& random) {
  double most = -1e300;
  std::vector<double> logs(particles_.size());
  for (std::size_t i = 0; i < particles_.size(); ++i) {
    logs[i] = std::log(particles_[i].weight) +
              kTempering * log_likelihood(map, particles_[i].pose, mounting, observations, count);
    most = std::max(most, logs[i]);
  }
  double sum = 0.0, squares = 0.0;
  for (std::size_t i = 0; i < particles_.size(); ++i) {
    particles_[i].weight = std::exp(logs[i] - most);
    sum += particles_[i].weight;
  }
  for (auto& p : particles_) {
    p.weight = std::max(p.weight / sum, 1e-300);
    squares += p.weight * p.weight;
  }
  const field_core::Belief now = belief(field_core::Stamp(0));
  if (1.0 / squares < 0.5 * wanted_) resample(random);
  // A third of a cell, and 17 degrees: near enough for the filter's linearization.
  const double position = std::sqrt(now.covariance.topLeftCorner<2, 2>().trace());
  if (position > grid_.cell_size / 3.0 || now.covariance(2, 2) > 0.3 * 0.3) return std::nullopt;
  return now;
}

void Relocalization::resample(field_core::Random& random) {
  const double step = 1.0 / static_cast<double>(particles_.size());
  double target = step * random.uniform(), sum = particles_[0].weight;
  std::size_t i = 0;
  for (auto& r : resampled_) {
    while (sum < target && i + 1 < particles_.size()) sum += particles_[++i].weight;
    // Spread a little: copies of one pose would stay one where odometry has no noise.
    const SE2& p = particles_[i].pose;
    r.pose =
        SE2(p.x() + random.normal(0.0, 0.03 * grid_.cell_size),
            p.y() + random.normal(0.0, 0.03 * grid_.cell_size), p.yaw() + random.normal(0.0, 0.03));
    r.weight = step;
    target += step;
  }
  resampled_.swap(particles_);
}

field_core::Belief Relocalization::belief(field_core::Stamp stamp) const {
  field_core::Belief belief{stamp, {}, {}, particles_};
  field_core::summarize_particles(particles_, belief.mean, belief.covariance);
  return belief;
}

void Relocalization::save(field_core::State& state) const {
  Eigen::MatrixXd all(4, particles_.size());
  for (std::size_t i = 0; i < particles_.size(); ++i) {
    all.col(i) << particles_[i].pose.vector(), particles_[i].weight;
  }
  state.set("particles", all);
}

void Relocalization::restore(const field_core::State& state) {
  const Eigen::MatrixXd& all = state.matrix("particles", 4, -1);
  particles_.clear();
  for (Eigen::Index i = 0; i < all.cols(); ++i) {
    particles_.push_back({SE2(Eigen::Vector3d(all.col(i).head<3>())), all(3, i)});
  }
  resampled_ = particles_;
}

}  // namespace vector_field_slam
