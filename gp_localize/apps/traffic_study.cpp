#include "traffic_study.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <chrono>
#include <cmath>

#include "field_core/errors.hpp"
#include "gp_localize/support_set.hpp"

namespace gp_localize {
namespace {

// Streams of random numbers that must not be the same.
constexpr std::uint64_t kTraining = 1000003, kVehicle = 2000003, kFilter = 3000017,
                        kSurvey = 4000037;

GraphMotion learn_motion(const TrafficNetwork& network, const Eigen::VectorXd& speeds,
                         const TrafficSettings& s) {
  GraphMotion motion(network.graph);
  field_core::Random random(kTraining);
  for (int vehicle = 0; vehicle < s.training_vehicles; ++vehicle) {
    motion.learn(drive(network.graph, speeds, Driving(), random));
  }
  return motion;
}

/// 85th percentile over one day of each node.
Eigen::VectorXd free_flow(const TrafficNetwork& network, int first, int rows) {
  Eigen::VectorXd result(network.speeds.cols());
  for (Eigen::Index node = 0; node < result.size(); ++node) {
    const Eigen::VectorXd day = network.speeds.col(node).segment(first, rows);
    std::vector<double> sorted(day.data(), day.data() + day.size());
    std::sort(sorted.begin(), sorted.end());
    result[node] = sorted[static_cast<std::size_t>(0.85 * static_cast<double>(rows))];
  }
  return result;
}

/// Rasmussen and Williams 2006, eq. 5.12.
double left_out_error(const Places& places, const Eigen::VectorXd& values, const LearnedField& f) {
  const field_core::Kernel kernel(f.kernel, f.value.signal_stddev, f.value.length_scales);
  Eigen::MatrixXd sigma = kernel.matrix(places, places);
  sigma.diagonal().array() += f.value.noise_stddev * f.value.noise_stddev;
  const Eigen::MatrixXd inverse =
      sigma.llt().solve(Eigen::MatrixXd::Identity(places.cols(), places.cols()));
  const Eigen::VectorXd alpha = inverse * (values.array() - f.value.mean).matrix();
  return std::sqrt(alpha.cwiseQuotient(inverse.diagonal()).squaredNorm() /
                   static_cast<double>(values.size()));
}

Eigen::VectorXd certain(int nodes, int node) { return Eigen::VectorXd::Unit(nodes, node); }

}  // namespace

TrafficStudy::TrafficStudy(const std::string& folder, const TrafficSettings& settings)
    : settings_(settings),
      network_(read_traffic_network(folder)),
      segments_(segments(network_.graph)),
      metres_(distances(network_.graph)),
      motion_(learn_motion(network_, speeds(settings.training_day), settings)) {
  const Places graph = embed(metres_ / 1000.0, settings.embedding);
  const int first = row_at(network_, settings.training_day, 0.0);
  const int next = row_at(network_, settings.training_day + 1, 0.0);
  places_.resize(settings.embedding + 1, graph.cols());
  places_.topRows(settings.embedding) = graph;
  places_.bottomRows(1) = free_flow(network_, first, next - first).transpose() / 10.0;
}

Eigen::VectorXd TrafficStudy::speeds(int day) const {
  return network_.speeds.row(row_at(network_, day, settings_.minute)).transpose();
}

TrafficDomain TrafficStudy::domain(bool plane) const {
  TrafficDomain d{plane ? "plane" : "graph",
                  plane ? Places(network_.positions / 1000.0) : places_,
                  {},
                  0.0,
                  0.0};
  const Eigen::VectorXd truth = speeds(settings_.training_day);
  // Two readings at each node: one could not tell what a detector has of its own from noise.
  const Eigen::Index nodes = truth.size();
  FieldSurvey survey{Places(d.places.rows(), 2 * nodes), Eigen::VectorXd(2 * nodes)};
  field_core::Random random(kSurvey);
  for (Eigen::Index i = 0; i < 2 * nodes; ++i) {
    survey.places.col(i) = d.places.col(i % nodes);
    survey.values[i] = truth[i % nodes] + settings_.reading_stddev * random.normal();
  }
  LearningOptions options;
  options.starts = 2;
  options.kernels = {field_core::KernelType::squared_exponential, field_core::KernelType::matern52,
                     field_core::KernelType::matern32};
  d.field = learn_hyperparameters(survey, options);
  d.left_out_training = left_out_error(d.places, speeds(settings_.training_day), d.field);
  d.left_out_test = left_out_error(d.places, speeds(settings_.test_day), d.field);
  return d;
}

void TrafficStudy::prepare_field() {
  if (!field_.empty()) return;
  const LearnedField learned = domain(false).field;
  const Hyperparameters& h = learned.value;
  const field_core::Kernel kernel(learned.kernel, h.signal_stddev, h.length_scales);
  const double noise_variance = h.noise_stddev * h.noise_stddev;
  const Places support = most_informative(places_, settings_.support, kernel, noise_variance);
  field_.push_back(
      {{"speed", "mph"}, h.mean, noise_variance, SupportBasis(kernel, support, 1e-8, 0.0)});
}

Eigen::VectorXd TrafficStudy::draw_field(field_core::Random& random) {
  prepare_field();
  Eigen::MatrixXd sigma = field_.front().basis.kernel().matrix(places_, places_);
  sigma.diagonal().array() += 1e-6 * sigma(0, 0);
  Eigen::VectorXd white(sigma.rows());
  for (double& value : white) value = random.normal();
  return (sigma.llt().matrixL() * white).array() + field_.front().mean;
}

TrafficStudy::Run TrafficStudy::simulate(std::uint64_t seed) {
  field_core::Random random(kVehicle + seed);
  const Eigen::VectorXd truth = speeds(settings_.test_day);
  Run run{truth, drive(network_.graph, truth, settings_.driving, random), {}};
  if (settings_.drawn) run.field = draw_field(random);
  if (settings_.vehicle == Vehicle::generated) {
    int arc = motion_.arrive(run.route.front(), random);
    for (std::size_t step = 1; step < run.route.size(); ++step) {
      arc = motion_.move(arc, random);
      run.route[step] = network_.graph.head(arc);
    }
  }
  for (const int node : run.route) {
    run.readings.push_back(run.field[node] + settings_.reading_stddev * random.normal());
  }
  return run;
}

const std::vector<std::string>& TrafficStudy::methods() {
  static const std::vector<std::string> kMethods = {
      "motion_only",      "gp_localize",  "sod_truncate", "sod_even",   "own_gp_localize",
      "own_sod_truncate", "own_sod_even", "other_day",    "known_field"};
  return kMethods;
}

/// The rules of docs/results/gp_localize.md: for the paper's method slices of 10 and a likelihood
/// with twice the noise; for a map per particle slices of 30, honest noise and an exponent.
GpLocalizeParams TrafficStudy::params(const std::string& method) const {
  GpLocalizeParams p;
  const bool own = method.rfind("own_", 0) == 0;
  p.particles = settings_.particles;
  p.sample_paths = settings_.sample_paths;
  p.map_hypotheses = own ? MapHypotheses::particle : MapHypotheses::sample_paths;
  p.slice_size = own ? 30 : 10;
  p.likelihood_noise_scale = own ? 1.0 : 2.0;
  p.likelihood_exponent = own ? 0.25 : 1.0;
  const std::string model = own ? method.substr(4) : method;
  if (model == "sod_truncate") {
    p.observation_model = ObservationModelType::sod_truncate;
    p.subset_size = 10;
  } else if (model == "sod_even") {
    p.observation_model = ObservationModelType::sod_even;
    p.subset_size = settings_.support;
  }
  return p;
}

/// Belief after each step.
std::vector<Eigen::VectorXd> TrafficStudy::filter(const std::string& method, const Run& run,
                                                  std::uint64_t seed) {
  GraphLocalize filter(params(method), {motion_, places_, field_.front()}, kFilter + seed);
  filter.start(certain(network_.graph.nodes(), run.route.front()));
  std::vector<Eigen::VectorXd> beliefs;
  for (std::size_t step = 0; step < run.route.size(); ++step) {
    if (step > 0) filter.predict();
    filter.update(run.readings[step]);
    beliefs.push_back(filter.belief());
  }
  return beliefs;
}

/// With no map, with the map of another day, or with the field itself: exact.
std::vector<Eigen::VectorXd> TrafficStudy::forward(const std::string& method,
                                                   const Run& run) const {
  GraphForwardFilter filter(motion_, certain(network_.graph.nodes(), run.route.front()));
  const Eigen::VectorXd training = speeds(settings_.training_day);
  const Eigen::VectorXd map = method == "known_field" ? run.field : training;
  const double own = settings_.reading_stddev * settings_.reading_stddev;
  const double between_days = (speeds(settings_.training_day + 1) - training).cwiseAbs2().mean();
  const double variance = own + (method == "known_field" ? 0.0 : between_days);
  std::vector<Eigen::VectorXd> beliefs;
  for (std::size_t step = 0; step < run.route.size(); ++step) {
    if (step > 0) filter.predict();
    if (method != "motion_only") {
      filter.update(-0.5 / variance * (map.array() - run.readings[step]).square());
    }
    beliefs.push_back(filter.belief());
  }
  return beliefs;
}

TrafficResult TrafficStudy::localize(const std::string& method, const Run& run,
                                     std::uint64_t seed) {
  const auto& known = methods();
  if (std::find(known.begin(), known.end(), method) == known.end()) {
    std::string list;
    for (const std::string& name : known) list += (list.empty() ? "" : ", ") + name;
    throw field_core::DataError("'" + method + "' is no method; there are " + list);
  }
  const bool exact = method == "motion_only" || method == "other_day" || method == "known_field";
  if (!exact) prepare_field();
  const auto begin = std::chrono::steady_clock::now();
  const auto beliefs = exact ? forward(method, run) : filter(method, run, seed);
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
  const auto steps = static_cast<double>(run.route.size());
  TrafficResult result{0.0, 0.0, 0.0, taken.count() / steps, {}};
  for (std::size_t step = 0; step < run.route.size(); ++step) {
    const int estimate = least_expected_distance(segments_, beliefs[step]), truth = run.route[step];
    result.errors.push_back(segments_(estimate, truth));
    result.segments += segments_(estimate, truth) / steps;
    result.kilometres += metres_(estimate, truth) / 1000.0 / steps;
    result.exact += (estimate == truth ? 1.0 : 0.0) / steps;
  }
  return result;
}

}  // namespace gp_localize
