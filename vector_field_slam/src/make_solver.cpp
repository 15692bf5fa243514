#include <algorithm>
#include <cmath>

#include "field_core/errors.hpp"
#include "vector_field_slam/batch_solver.hpp"
#include "vector_field_slam/ekf_solver.hpp"
#include "vector_field_slam/eseif_solver.hpp"
#include "vector_field_slam/localize_solver.hpp"
#include "vector_field_slam/vector_field_slam.hpp"

namespace vector_field_slam {
namespace {

double square(double x) { return x * x; }

/// The x with P(chi^2_1 <= x) = p, by bisection: erf(sqrt(x / 2)) = p.
double chi_square_quantile(double p) {
  double low = 0.0, high = 100.0;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (std::erf(std::sqrt(0.5 * middle)) < p ? low : high) = middle;
  }
  return high;
}

EseifOptions eseif_options(const VectorFieldSlamParams& p, double gate) {
  EseifOptions o;
  o.gate = gate;
  o.underweighting = p.underweighting;
  o.relocation = p.relocation;
  const double xy = square(p.relocation_stddev_xy), c = square(p.relocation_stddev_calibration);
  o.relocation_variance << xy, xy, square(p.relocation_stddev_a), c, c;
  o.rings = p.recovery_rings;
  o.most_nodes = p.max_nodes;
  return o;
}

BackgroundOptions background_options(const VectorFieldSlamParams& p) {
  constexpr int kBatchPeriod = 50;
  BackgroundOptions o;
  o.period = p.background_period > 0 ? p.background_period : kBatchPeriod;
  o.delay = p.solver == SolverType::batch ? 0 : std::min(p.background_delay, o.period);
  o.most_poses = p.background_poses;
  return o;
}

template <int M>
std::unique_ptr<Solver> make(const VectorFieldSlamParams& params,
                             const std::vector<ChannelModel>& channels, double gate) {
  const Model<M> model(params, channels);
  switch (params.solver) {
    case SolverType::ekf:
      return std::make_unique<EkfSolver<M>>(model, gate, params.max_nodes, params.underweighting);
    case SolverType::eseif:
      if (params.background_period == 0) {
        return std::make_unique<EseifSolver<M>>(model, eseif_options(params, gate));
      }
      break;
    case SolverType::batch:
      break;
  }
  return std::make_unique<BatchSolver<M>>(model, eseif_options(params, gate),
                                          background_options(params));
}

std::unique_ptr<Solver> make_for_channels(const VectorFieldSlamParams& params,
                                          const std::vector<ChannelModel>& channels, double gate) {
  switch (channels.size()) {
    case 1:
      return make<1>(params, channels, gate);
    case 2:
      return make<2>(params, channels, gate);
    case 3:
      return make<3>(params, channels, gate);
    case 4:
      return make<4>(params, channels, gate);
    case 5:
      return make<5>(params, channels, gate);
    case 6:
      return make<6>(params, channels, gate);
    case 7:
      return make<7>(params, channels, gate);
    case 8:
      return make<8>(params, channels, gate);
    default:
      throw field_core::ParameterError("channels", "between 1 and 8 are allowed");
  }
}

}  // namespace

std::unique_ptr<Solver> make_solver(const VectorFieldSlamParams& params,
                                    const std::vector<ChannelModel>& channels) {
  const double gate =
      params.gate_probability < 1.0 ? chi_square_quantile(params.gate_probability) : 0.0;
  auto solver = make_for_channels(params, channels, gate);
  if (!params.localize_only) return solver;
  const auto grid =
      GridGeometry<double>::around(params.initial_pose_x, params.initial_pose_y, params.cell_size);
  return std::make_unique<LocalizeSolver>(std::move(solver), channels, grid, gate);
}

}  // namespace vector_field_slam
