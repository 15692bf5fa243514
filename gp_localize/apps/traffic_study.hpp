// The paper's traffic experiment (section 4.3) on METR-LA: what is learned before the run, one
// simulated vehicle per seed, and the methods that localize it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "gp_localize/graph_localize.hpp"
#include "gp_localize/hyperparameter_learning.hpp"
#include "traffic_network.hpp"

namespace gp_localize {

/// Where vehicles come from: drawn from the learned motion model, which is how we read the paper's
/// "generated trajectory"; or on trips of their own, which the model only approximates.
enum class Vehicle { generated, trips };

struct TrafficSettings {
  Vehicle vehicle = Vehicle::generated;
  bool drawn = false;           ///< the field is no day's, but a draw from the learned model
  Driving driving;              ///< of the vehicle; 370 steps are the paper's
  int test_day = 5;             ///< Tuesday, 6 March 2012
  int training_day = 0;         ///< Thursday; the Friday after it says how much days differ
  double minute = 1050.0;       ///< 17:30, evening peak as in the paper
  double reading_stddev = 2.0;  ///< [mph] of a vehicle's own speed about the detector's
  int training_vehicles = 200;  ///< of trips
  int embedding = 5;            ///< coordinates
  int particles = 400, sample_paths = 400, support = 40;  ///< the paper's
};

/// A node as a place: `embedding` coordinates of the graph [km] and the free-flow speed of the
/// training day (85th percentile) [10 mph]; or for comparison its position in the plane [km].
struct TrafficDomain {
  std::string name;
  field_core::Places places;
  LearnedField field;  ///< maximum likelihood, two readings at each node on the training day
  /// Root mean square error at each node from all others, under these hyperparameters [mph].
  double left_out_training, left_out_test;
};

struct TrafficResult {
  double segments, kilometres;  ///< mean error
  double exact;                 ///< share of steps with the right node
  double step_seconds;
  std::vector<double> errors;  ///< segments, by step
};

class TrafficStudy {
 public:
  /// @throws DataError for files that are missing or wrong, see read_traffic_network
  TrafficStudy(const std::string& folder, const TrafficSettings& settings);

  const TrafficNetwork& network() const { return network_; }
  const GraphMotion& motion() const { return motion_; }
  /// The graph's, and the plane's.
  TrafficDomain domain(bool plane) const;

  struct Run {
    Eigen::VectorXd field;   ///< at each node [mph]
    std::vector<int> route;  ///< node of each step
    std::vector<double> readings;
  };
  /// The vehicle of a seed.
  Run simulate(std::uint64_t seed);
  static const std::vector<std::string>& methods();
  /// @throws DataError for a method that is not one of methods()
  TrafficResult localize(const std::string& method, const Run& run, std::uint64_t seed);

 private:
  Eigen::VectorXd speeds(int day) const;
  GpLocalizeParams params(const std::string& method) const;
  void prepare_field();
  Eigen::VectorXd draw_field(field_core::Random& random);
  std::vector<Eigen::VectorXd> filter(const std::string& method, const Run& run,
                                      std::uint64_t seed);
  std::vector<Eigen::VectorXd> forward(const std::string& method, const Run& run) const;

  TrafficSettings settings_;
  TrafficNetwork network_;
  Eigen::MatrixXd segments_, metres_;
  GraphMotion motion_;
  field_core::Places places_;
  std::vector<FieldModel> field_;  // none before it is needed, then one
};

}  // namespace gp_localize
