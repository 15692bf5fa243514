// BatchLog: to and from a state.
#include "field_core/errors.hpp"
#include "vector_field_slam/batch_log.hpp"

namespace vector_field_slam {
namespace {

constexpr int kLinkRows = 13;  // absolute, (x, y, yaw), W column by column

void save_link(const PoseLink& link, Eigen::Ref<Eigen::VectorXd> column) {
  column << (link.absolute ? 1.0 : 0.0), link.value.vector(),
      Eigen::Map<const Eigen::Matrix<double, 9, 1>>(link.square_root.data());
}

PoseLink load_link(const Eigen::Ref<const Eigen::VectorXd>& column) {
  PoseLink link;
  link.absolute = column[0] != 0.0;
  link.value = field_core::SE2(Eigen::Vector3d(column.segment<3>(1)));
  Eigen::Map<Eigen::Matrix<double, 9, 1>>(link.square_root.data()) = column.tail<9>();
  return link;
}

/// An index below `count`. @throws DataError naming the block
int load_index(double value, std::size_t count, const char* block) {
  if (value >= 0.0 && value < static_cast<double>(count)) return static_cast<int>(value);
  throw field_core::DataError("state block '" + std::string(block) +
                              "' refers to something that is not there; the file is damaged");
}

GridIndex load_grid_index(double x, double y, const char* block) {
  constexpr double kLargest = GridGeometry<double>::kLargestIndex + 1;
  if (std::abs(x) <= kLargest && std::abs(y) <= kLargest) {
    return {static_cast<std::int16_t>(x), static_cast<std::int16_t>(y)};
  }
  throw field_core::DataError("state block '" + std::string(block) +
                              "' names a place off the grid; the file is damaged");
}

template <int M>
void save_measurements(const BatchProblem<M>& p, field_core::State& state) {
  Eigen::MatrixXd measurements(8, p.measurements.size()), readings(3, p.readings.size());
  Eigen::Index k = 0;
  for (const auto& m : p.measurements) {
    measurements.col(k++) << m.pose, m.mounting.x, m.mounting.y, m.mounting.yaw, m.first, m.count,
        m.cell.x, m.cell.y;
  }
  k = 0;
  for (const auto& z : p.readings) readings.col(k++) << z.channel, z.value, z.variance;
  state.set("log_measurements", measurements);
  state.set("log_readings", readings);
}

template <int M>
void load_measurements(const field_core::State& state, BatchProblem<M>& p) {
  const Eigen::MatrixXd &measurements = state.matrix("log_measurements", 8, -1),
                        &readings = state.matrix("log_readings", 3, -1);
  const auto count = static_cast<std::size_t>(readings.cols());
  for (Eigen::Index k = 0; k < readings.cols(); ++k) {
    p.readings.push_back(
        {load_index(readings(0, k), M, "log_readings"), readings(1, k), readings(2, k)});
  }
  for (const auto& m : measurements.colwise()) {
    const GridIndex cell = load_grid_index(m[6], m[7], "log_measurements");
    for (int j = 0; j < 4; ++j) {
      load_index(p.table.find(cell_node(cell, j)), p.nodes.size(), "log_measurements");
    }
    load_index(m[4] + m[5], count + 1, "log_measurements");
    p.measurements.push_back({load_index(m[0], p.poses.size(), "log_measurements"),
                              {m[1], m[2], m[3]},
                              load_index(m[4], count + 1, "log_measurements"),
                              load_index(m[5], M + 1, "log_measurements"),
                              cell});
  }
}

template <int M>
void save_nodes(const BatchProblem<M>& p, field_core::State& state) {
  const auto count = static_cast<Eigen::Index>(p.nodes.size());
  Eigen::MatrixXd nodes(M + 2, count), priors(1 + 2 * M, p.priors.size()),
      links(3, p.node_links.size());
  for (Eigen::Index i = 0; i < count; ++i) {
    const GridIndex index = p.table.index(static_cast<int>(i));
    nodes.col(i) << index.x, index.y, p.nodes[static_cast<std::size_t>(i)];
  }
  Eigen::Index k = 0;
  for (const auto& prior : p.priors) priors.col(k++) << prior.node, prior.mean, prior.variance;
  k = 0;
  for (const auto& l : p.node_links) links.col(k++) << l.node, l.near, l.far;
  state.set("log_nodes", nodes);
  state.set("log_priors", priors);
  state.set("log_node_links", links);
}

template <int M>
void load_nodes(const field_core::State& state, BatchProblem<M>& p) {
  const Eigen::MatrixXd &nodes = state.matrix("log_nodes", M + 2, -1),
                        &priors = state.matrix("log_priors", 1 + 2 * M, -1),
                        &links = state.matrix("log_node_links", 3, -1);
  for (const auto& n : nodes.colwise()) {
    const GridIndex index = load_grid_index(n[0], n[1], "log_nodes");
    if (p.table.find(index) >= 0) {
      throw field_core::DataError("state block 'log_nodes' has a node twice; the file is damaged");
    }
    p.table.insert(index);
    p.nodes.emplace_back(n.template tail<M>());
  }
  for (const auto& n : priors.colwise()) {
    p.priors.push_back({load_index(n[0], p.nodes.size(), "log_priors"), n.template segment<M>(1),
                        n.template tail<M>()});
  }
  for (const auto& n : links.colwise()) {
    int node[3];
    for (int i = 0; i < 3; ++i) node[i] = load_index(n[i], p.nodes.size(), "log_node_links");
    p.node_links.push_back({node[0], node[1], node[2]});
  }
}

}  // namespace

template <int M>
void BatchLog<M>::save(field_core::State& state) const {
  const auto& p = problem_;
  const auto count = static_cast<Eigen::Index>(p.poses.size());
  Eigen::MatrixXd poses(3, count), links(kLinkRows, count + 1);
  for (Eigen::Index t = 0; t < count; ++t) {
    poses.col(t) = p.poses[static_cast<std::size_t>(t)];
    save_link(p.links[static_cast<std::size_t>(t)], links.col(t));
  }
  save_link(next_, links.col(count));  // the one that is being added up
  state.set("log_poses", poses);
  state.set("log_links", links);
  state.set("log_next_covariance", covariance_);
  state.set("log_start_mean", p.start_mean);
  state.set("log_start_information", p.start_information);
  state.set("log_offset", p.offset);
  save_nodes(p, state);
  save_measurements(p, state);
}

template <int M>
void BatchLog<M>::restore(const field_core::State& state) {
  BatchProblem<M> p;
  const Eigen::MatrixXd& poses = state.matrix("log_poses", 3, -1);
  const Eigen::MatrixXd& links = state.matrix("log_links", kLinkRows, poses.cols() + 1);
  for (Eigen::Index t = 0; t < poses.cols(); ++t) {
    p.poses.emplace_back(poses.col(t));
    p.links.push_back(load_link(links.col(t)));
  }
  p.start_mean = state.matrix("log_start_mean", kRobot, 1);
  p.start_information = state.matrix("log_start_information", kRobot, kRobot);
  p.offset = state.matrix("log_offset", 2, 1);
  load_nodes(state, p);
  load_measurements(state, p);
  covariance_ = state.matrix("log_next_covariance", 3, 3);
  next_ = load_link(links.col(poses.cols()));
  problem_ = std::move(p);
}

// Of the members that are here only: batch_log.cpp has the classes.
#define INSTANTIATE(M)                                       \
  template void BatchLog<M>::save(field_core::State&) const; \
  template void BatchLog<M>::restore(const field_core::State&)
INSTANTIATE(1);
INSTANTIATE(2);
INSTANTIATE(3);
INSTANTIATE(4);
INSTANTIATE(5);
INSTANTIATE(6);
INSTANTIATE(7);
INSTANTIATE(8);
#undef INSTANTIATE

}  // namespace vector_field_slam
