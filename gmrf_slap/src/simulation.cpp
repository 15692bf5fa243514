#include "simulation.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <chrono>
#include <cmath>

#include "field_core/cholmod.hpp"
#include "field_core/random.hpp"
#include "gmrf_slap/slap.hpp"

namespace gmrf_slap {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using field_core::Random;

constexpr double kNinetyPercent = 1.6448536269514722;  // of |x| for N(0, 1)
constexpr double kNinetyPercentSquared2d = 4.605170185988092;

/// What happens in one step of one robot.
struct Event {
  Vector2d truth, command, observed;
  double value;
};

class World {
 public:
  World(const SimulationSettings& settings, std::uint64_t seed)
      : settings_(settings),
        lattice_(Vector2d::Constant(-0.5 * (settings.side - 1)), 1.0, settings.side, settings.side,
                 settings.wrap),
        field_(settings.field.size() > 0 ? settings.field : draw_field(seed)) {
    for (int r = 0; r < settings.robots; ++r) drive(seed + 1000003u * static_cast<unsigned>(r + 1));
  }

  const Lattice& lattice() const { return lattice_; }
  const Eigen::VectorXd& field() const { return field_; }
  const Event& event(int robot, int step) const {
    return events_[static_cast<std::size_t>(robot)][static_cast<std::size_t>(step)];
  }

 private:
  Eigen::VectorXd draw_field(std::uint64_t seed) const {
    // z = Q^(-1/2) white: order 2 is the square of kappa^(1/2) (alpha I + G), itself symmetric, so
    // that one solve draws it.
    Random random(seed);
    Eigen::VectorXd white(lattice_.sites());
    for (Eigen::Index i = 0; i < white.size(); ++i) white[i] = random.normal();
    const Theta root{std::sqrt(settings_.truth.kappa), settings_.truth.alpha, 1};
    field_core::SparseCholesky factor;
    const Eigen::SparseMatrix<double> lower =
        prior_precision(lattice_, root).triangularView<Eigen::Lower>();
    factor.factorize(lower);
    return factor.solve(white);
  }

  /// A heading that wanders and turns back at the edge; each place is rounded to a site (eq. 18).
  void drive(std::uint64_t seed) {
    Random random(seed);
    const double edge = 0.5 * (settings_.side - 1);
    Vector2d q(std::round(random.uniform(-edge, edge)), std::round(random.uniform(-edge, edge)));
    q = lattice_.position(lattice_.nearest(q));
    double heading = random.uniform(-M_PI, M_PI);
    std::vector<Event> events;
    for (int t = 0; t < settings_.steps; ++t) {
      Event event;
      Vector2d next;
      do {
        heading += random.normal(0.0, 0.5);
        event.command = settings_.command_length * Vector2d(std::cos(heading), std::sin(heading));
        next = q + event.command +
               settings_.process_stddev * Vector2d(random.normal(), random.normal());
      } while (std::abs(next.x()) > edge || std::abs(next.y()) > edge);
      if (t > 0) q = lattice_.position(lattice_.nearest(next));
      event.truth = q;
      event.observed = q + settings_.position_stddev * Vector2d(random.normal(), random.normal());
      event.value = field_[lattice_.nearest(q)] + settings_.measurement_stddev * random.normal();
      events.push_back(event);
    }
    events_.push_back(std::move(events));
  }

  SimulationSettings settings_;
  Lattice lattice_;
  Eigen::VectorXd field_;
  std::vector<std::vector<Event>> events_;
};

Eigen::Matrix2Xd site_positions(const Lattice& lattice) {
  Eigen::Matrix2Xd points(2, lattice.sites());
  for (int s = 0; s < lattice.sites(); ++s) points.col(s) = lattice.position(s);
  return points;
}

/// Field errors, and at the end its coverage, of a mean and of a prediction at all sites.
class FieldScore {
 public:
  FieldScore(const World& world, const SimulationSettings& settings, SimulationRecord* record)
      : world_(world), settings_(settings), truth_(world.field()), record_(record) {}
  bool due(int step) const {
    return (step + 1) % settings_.score_every == 0 || step + 1 == settings_.steps;
  }
  void add(const Eigen::VectorXd& mean, SimulationResult& result) {
    result.final_squared_error = (mean - truth_).squaredNorm() / static_cast<double>(truth_.size());
    sum_ += result.final_squared_error;
    result.squared_error = sum_ / ++count_;
  }
  void finish(const field_core::FieldPrediction& prediction, SimulationResult& result) const {
    const double noise = settings_.measurement_stddev * settings_.measurement_stddev;
    int inside = 0;
    for (Eigen::Index s = 0; s < truth_.size(); ++s) {
      const double stddev = std::sqrt(std::max(prediction.variance(0, s) - noise, 0.0));
      inside += std::abs(truth_[s] - prediction.mean(0, s)) <= kNinetyPercent * stddev;
    }
    result.field_coverage = static_cast<double>(inside) / static_cast<double>(truth_.size());
    if (!record_) return;
    record_->sites = site_positions(world_.lattice());
    record_->truth = truth_;
    record_->mean = prediction.mean.row(0);
    record_->variance = prediction.variance.row(0).array() - noise;
  }
  void visit(int step, int robot, const Event& event, const Vector2d& estimate,
             const Matrix2d& covariance) const {
    if (!record_) return;
    record_->visits.push_back({step, robot, event.truth, event.observed, estimate, covariance});
  }

 private:
  const World& world_;
  const SimulationSettings& settings_;
  const Eigen::VectorXd& truth_;
  SimulationRecord* record_;
  double sum_ = 0.0;
  int count_ = 0;
};

SimulationResult known_positions(const World& world, const SimulationSettings& settings,
                                 const GmrfSlapParams& params, bool exact,
                                 SimulationRecord* record) {
  SimulationResult result;
  FieldBank fields(params);
  FieldScore score(world, settings, record);
  const double noise = settings.measurement_stddev * settings.measurement_stddev;
  for (int t = 0; t < settings.steps; ++t) {
    for (int r = 0; r < settings.robots; ++r) {
      const Event& event = world.event(r, t);
      const Vector2d place =
          exact ? event.truth : world.lattice().position(world.lattice().nearest(event.observed));
      fields.assimilate({0, event.value, noise}, place);
      score.visit(t, r, event, place, Matrix2d::Zero());
    }
    if (score.due(t)) score.add(fields.fields()[0].site_mean(), result);
  }
  score.finish(fields.predict(site_positions(world.lattice())), result);
  result.true_theta = fields.fields()[0].probability[0];
  return result;
}

SimulationResult slap_positions(const World& world, const SimulationSettings& settings,
                                const GmrfSlapParams& params, std::uint64_t seed,
                                SimulationRecord* record) {
  SimulationResult result;
  Slap slap(params, seed);
  FieldScore score(world, settings, record);
  const double w = settings.process_stddev * settings.process_stddev + 1.0 / 12.0;
  const Matrix2d process = w * Matrix2d::Identity();
  field_core::Sample sample;
  sample.readings.resize(1);
  double seconds = 0.0, distance = 0.0;
  int inside = 0, late = 0;
  for (int r = 0; r < settings.robots; ++r) {
    if (!settings.known_start) slap.scatter(r);
    if (settings.known_start) {
      const Vector2d q = world.event(r, 0).truth;
      slap.set_pose(r, field_core::SE2(q.x(), q.y(), 0.0), Eigen::Matrix3d::Zero());
    }
  }
  for (int t = 0; t < settings.steps; ++t) {
    for (int r = 0; r < settings.robots; ++r) {
      const Event& event = world.event(r, t);
      const auto start = std::chrono::steady_clock::now();
      if (t > 0) slap.displace(r, event.command, process);
      slap.observe_position(r, event.observed);
      sample.readings[0] = {0, event.value, 0.0};
      slap.update(r, sample);
      seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      const field_core::Belief belief = slap.belief(r);
      const Vector2d error = event.truth - belief.mean.translation();
      const Matrix2d covariance = belief.covariance.topLeftCorner<2, 2>();
      score.visit(t, r, event, belief.mean.translation(), covariance);
      inside += error.dot(covariance.inverse() * error) <= kNinetyPercentSquared2d;
      result.left_out += slap.left_out_mass(r);
      if (10 * t >= 9 * settings.steps) {
        distance += error.norm();
        ++late;
      }
    }
    if (score.due(t)) score.add(slap.site_mean(0), result);
  }
  const double events = static_cast<double>(settings.steps) * settings.robots;
  result.position_error = distance / late;
  result.position_coverage = inside / events;
  result.left_out /= events;
  result.step_seconds = seconds / events;
  score.finish(slap.predict_field(site_positions(world.lattice())), result);
  result.true_theta = slap.hyperparameters()[0].probability[0];
  return result;
}

}  // namespace

std::vector<HyperparameterParams> paper_hyperparameters(const Theta& theta) {
  std::vector<HyperparameterParams> out;
  for (const auto& [k, a] :
       {std::pair{1.0, 1.0}, {0.1, 1.0}, {10.0, 1.0}, {1.0, 0.1}, {1.0, 10.0}}) {
    HyperparameterParams h;
    h.kappa = k * theta.kappa;
    h.alpha = a * theta.alpha;
    h.order = theta.order;
    out.push_back(h);
  }
  return out;
}

GmrfSlapParams simulation_params(const SimulationSettings& settings, GmrfSlapParams params) {
  params.fields = {{"field", FieldParams{}}};
  const double edge = 0.5 * (settings.side - 1);
  params.grid.origin = {-edge, -edge};
  params.grid.spacing = 1.0;
  params.grid.size = {static_cast<double>(settings.side), static_cast<double>(settings.side)};
  params.grid.wrap = settings.wrap;
  params.grid.interpolation = Interpolation::nearest;
  params.hyperparameters = paper_hyperparameters(settings.truth);
  params.measurement_stddev = settings.measurement_stddev;
  params.position_stddev = settings.position_stddev;
  params.robots.clear();
  for (int r = 0; r < settings.robots; ++r)
    params.robots.push_back("robot" + std::to_string(r + 1));
  return params;
}

SimulationResult simulate(const SimulationSettings& settings, const GmrfSlapParams& params,
                          Knowledge knowledge, std::uint64_t seed, SimulationRecord* record) {
  const World world(settings, seed);
  if (knowledge == Knowledge::slap) return slap_positions(world, settings, params, seed, record);
  return known_positions(world, settings, params, knowledge == Knowledge::exact, record);
}

}  // namespace gmrf_slap
