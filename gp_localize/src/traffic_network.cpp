#include "traffic_network.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "field_core/csv.hpp"
#include "field_core/errors.hpp"

namespace gp_localize {
namespace {

using field_core::CsvTable;

constexpr double kKernelWidth = 2600.0;  // [m] of the similarity weights
constexpr double kDetour = 1.1;
constexpr double kMetresPerSecond = 0.44704;  // of a mile per hour

[[noreturn]] void fail(const CsvTable& table, std::size_t row, const std::string& what) {
  throw field_core::DataError(table.path() + ":" + std::to_string(table.line(row)) + ": " + what);
}

int whole(const CsvTable& table, std::size_t row, std::size_t column) {
  const double value = table.number(row, column);
  if (value != std::floor(value) || std::abs(value) > 1e6) {
    fail(table, row, "'" + table.text(row, column) + "' is not the number of a sensor");
  }
  return static_cast<int>(value);
}

/// By the detector's number k, which must count from 0.
Eigen::Matrix2Xd read_positions(const std::string& path) {
  const auto table = CsvTable::read(path);
  const std::size_t k = table.column("k"), x = table.column("x_m"), y = table.column("y_m");
  Eigen::Matrix2Xd positions(2, table.rows());
  for (std::size_t row = 0; row < table.rows(); ++row) {
    if (whole(table, row, k) != static_cast<int>(row)) {
      fail(table, row,
           "sensor " + table.text(row, k) + " where " + std::to_string(row) +
               " is expected; number them from 0 without gaps");
    }
    positions.col(static_cast<Eigen::Index>(row)) << table.number(row, x), table.number(row, y);
  }
  return positions;
}

Graph read_pairs(const std::string& path, int sensors) {
  const auto table = CsvTable::read(path);
  const std::size_t from = table.column("from_k"), to = table.column("to_k"), w = table.column("w");
  std::map<std::pair<int, int>, double> lengths;  // the shorter of the two directions
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const int a = whole(table, row, from), b = whole(table, row, to);
    if (std::min(a, b) < 0 || std::max(a, b) >= sensors) {
      fail(table, row,
           "names a sensor that does not exist; there are sensors 0 to " +
               std::to_string(sensors - 1));
    }
    const double weight = table.number(row, w);
    if (!(weight > 0.0 && weight <= 1.0)) fail(table, row, "w must be above 0 and at most 1");
    if (a == b || weight == 1.0) continue;  // the detector itself
    const double length = kKernelWidth * std::sqrt(-std::log(weight));
    const auto known = lengths.emplace(std::minmax(a, b), length);
    if (!known.second) known.first->second = std::min(known.first->second, length);
  }
  std::vector<GraphEdge> edges;
  for (const auto& [pair, length] : lengths) edges.push_back({pair.first, pair.second, length});
  return {sensors, edges};
}

/// Travel time of each arc [s] at the mean speed of its two ends.
std::vector<double> travel_times(const Graph& graph, const Eigen::VectorXd& speeds_mph) {
  std::vector<double> times;
  for (int arc = 0; arc < graph.arcs(); ++arc) {
    const double mph = 0.5 * (speeds_mph[graph.tail(arc)] + speeds_mph[graph.head(arc)]);
    times.push_back(graph.length(arc) / (kMetresPerSecond * mph));
  }
  return times;
}

/// Arcs of the cheapest path, by stepping down the costs to go.
std::vector<int> quickest(const Graph& graph, const std::vector<double>& cost, int from, int to) {
  std::vector<double> reversed(cost.size());
  for (std::size_t arc = 0; arc < cost.size(); ++arc) reversed[arc] = cost[arc ^ 1];
  const Eigen::VectorXd to_go = shortest_paths_from(graph, reversed, to);
  std::vector<int> path;
  for (int node = from; node != to; node = graph.head(path.back())) {
    const auto& leaving = graph.leaving(node);
    path.push_back(*std::min_element(leaving.begin(), leaving.end(), [&](int a, int b) {
      return cost[a] + to_go[graph.head(a)] < cost[b] + to_go[graph.head(b)];
    }));
  }
  return path;
}

}  // namespace

TrafficNetwork read_traffic_network(const std::string& folder) {
  const Eigen::Matrix2Xd positions = read_positions(folder + "/sensors.csv");
  const auto sensors = static_cast<int>(positions.cols());
  const Graph all = without_detours(read_pairs(folder + "/edges.csv", sensors), kDetour);
  const std::vector<int> kept = largest_part(all);
  TrafficNetwork network{part(all, kept), kept, field_core::Places(2, kept.size()), {}, {}};
  const auto table = CsvTable::read(folder + "/speed_mph_10min.csv");
  const std::size_t minute = table.column("minute");
  network.speeds.resize(static_cast<Eigen::Index>(table.rows()),
                        static_cast<Eigen::Index>(kept.size()));
  for (std::size_t row = 0; row < table.rows(); ++row) {
    network.minutes.push_back(table.number(row, minute));
  }
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const auto node = static_cast<Eigen::Index>(i);
    network.positions.col(node) = positions.col(kept[i]);
    const std::size_t column = table.column("k" + std::to_string(kept[i]));
    for (std::size_t row = 0; row < table.rows(); ++row) {
      const double speed = table.number(row, column);
      if (!(speed > 0.0))
        fail(
            table, row,
            "column 'k" + std::to_string(kept[i]) + "': a speed must be positive; fill gaps first");
      network.speeds(static_cast<Eigen::Index>(row), node) = speed;
    }
  }
  return network;
}

int row_at(const TrafficNetwork& network, int day, double minute_of_day) {
  const double wanted = 1440.0 * day + minute_of_day;
  const auto& minutes = network.minutes;
  const auto found = std::find(minutes.begin(), minutes.end(), wanted);
  if (found == minutes.end()) {
    throw field_core::DataError("there are no speeds of day " + std::to_string(day) + ", minute " +
                                field_core::format_number(minute_of_day));
  }
  return static_cast<int>(found - minutes.begin());
}

std::vector<int> drive(const Graph& graph, const Eigen::VectorXd& speeds_mph,
                       const Driving& driving, field_core::Random& random) {
  constexpr double kTaste = 0.3;
  const auto anywhere = [&] { return static_cast<int>(random.index(graph.nodes())); };
  const std::vector<double> times = travel_times(graph, speeds_mph);
  std::vector<int> route, stops(driving.stops);
  for (int& stop : stops) stop = anywhere();
  int node = anywhere();
  double time_in = 0.0;  // half of the way to the node
  const auto stay = [&](double time_out) {
    const long reports = std::max(1L, std::lround((time_in + time_out) / driving.step_s));
    route.insert(route.end(), reports, node);
  };
  for (int trip = 0; static_cast<int>(route.size()) < driving.steps; ++trip) {
    const int goal = stops.empty() ? anywhere() : stops[trip % driving.stops];
    std::vector<double> cost = times;
    for (double& c : cost) c *= std::exp(kTaste * random.normal());
    for (const int arc : quickest(graph, cost, node, goal)) {
      stay(0.5 * times[arc]);
      time_in = 0.5 * times[arc];
      node = graph.head(arc);
    }
  }
  route.resize(driving.steps);
  return route;
}

}  // namespace gp_localize
