#include "gmrf_slap/field_bank.hpp"

#include <cmath>
#include <string>

#include "field_core/csv.hpp"
#include "field_core/errors.hpp"
#include "weights.hpp"

namespace gmrf_slap {
namespace {

using field_core::ParameterError;

Lattice make_lattice(const GridParams& grid) {
  return Lattice({grid.origin[0], grid.origin[1]}, grid.spacing, static_cast<int>(grid.size[0]),
                 static_cast<int>(grid.size[1]), grid.wrap);
}

Theta make_theta(const Lattice& lattice, const HyperparameterParams& h) {
  if (h.kappa > 0.0) return {h.kappa, h.alpha, h.order};
  const double alpha = alpha_of_bandwidth(h.bandwidth / lattice.spacing());
  return {kappa_of_variance(lattice, alpha, h.order, h.stddev * h.stddev), alpha, h.order};
}

FieldMixture make_field(const Lattice& lattice, const GmrfSlapParams& params,
                        const std::string& name, const FieldParams& f) {
  FieldMixture field;
  field.info = {name, f.unit};
  field.mean = f.mean;
  field.trend = {f.trend[0], f.trend[1]};
  const double noise = params.measurement_stddev_of(f);
  field.noise_variance = noise * noise;
  field.nugget_variance = f.nugget_stddev * f.nugget_stddev;
  const auto& list = f.hyperparameters.empty() ? params.hyperparameters : f.hyperparameters;
  field.prior.resize(static_cast<Eigen::Index>(list.size()));
  for (const HyperparameterParams& h : list) {
    field.prior[static_cast<Eigen::Index>(field.thetas.size())] = h.prior;
    field.thetas.push_back(make_theta(lattice, h));
    field.prior_variance.push_back(site_variance(lattice, field.thetas.back()));
  }
  field.prior /= field.prior.sum();
  return field;
}

/// Bandwidths that the local engine eliminates around its window, and the most sites that is.
/// gmrf_slap_benchmark --benchmark_filter=local_error measures what that leaves out.
constexpr double kHaloBandwidths = 3.5;
constexpr double kLargestHalo = 50.0;
/// Windows cost about as much to take as to carry for some steps; those of the sparse engine more.
constexpr int kLocalMargin = 6, kSparseMargin = 8;
/// Up to here a window of the whole grid costs less than to take another one every few steps.
constexpr int kGrowUpTo = 1000;

std::unique_ptr<GaussianField> make_engine(const Lattice& lattice, const GmrfSlapParams& params,
                                           const Theta& theta,
                                           const Eigen::SparseMatrix<double>& precision) {
  if (params.engine == Engine::dense) return make_dense_field(precision);
  WindowSettings settings;
  settings.memory = static_cast<int>(params.robots.size());
  settings.grow_up_to = kGrowUpTo;
  if (params.engine == Engine::local) {
    const double bandwidth = std::sqrt(2.0 / theta.alpha);
    settings.halo =
        static_cast<int>(std::min(std::ceil(kHaloBandwidths * bandwidth), kLargestHalo));
    settings.margin = kLocalMargin;
  } else {
    settings.margin = kSparseMargin;
  }
  return make_window_field(lattice, precision, settings);
}

/// Before anything is allocated. The prior is kept beside what is learned.
void check_memory(const GmrfSlapParams& params, const Lattice& lattice,
                  const std::vector<FieldMixture>& fields) {
  const double bytes =
      static_cast<double>(params.engine == Engine::dense ? dense_field_bytes(lattice.sites())
                                                         : window_field_bytes(lattice.sites()));
  std::size_t hypotheses = 0;
  for (const FieldMixture& field : fields) hypotheses += field.thetas.size();
  const double needed = 2.0 * 1e-6 * static_cast<double>(hypotheses) * bytes;
  if (needed <= params.memory_limit) return;
  using field_core::format_number;
  throw ParameterError("grid/size",
                       format_number(lattice.nx()) + " x " + format_number(lattice.ny()) +
                           " sites need " + format_number(std::ceil(needed)) +
                           " MB with this engine, memory_limit allows " +
                           std::to_string(params.memory_limit) +
                           " MB; enlarge grid/spacing, use engine: local or raise memory_limit");
}

}  // namespace

FieldBank::FieldBank(const GmrfSlapParams& params, const Walls& walls)
    : lattice_(make_lattice(params.grid)),
      interpolation_(params.grid.interpolation),
      walls_(std::make_shared<const Walls>(walls)),
      engine_(params.engine) {
  for (const auto& [name, field] : params.fields) {
    fields_.push_back(make_field(lattice_, params, name, field));
  }
  check_memory(params, lattice_, fields_);
  for (FieldMixture& field : fields_) {
    priors_.emplace_back();
    for (const Theta& theta : field.thetas) {
      priors_.back().push_back(make_engine(
          lattice_, params, theta, prior_precision(lattice_, theta, walls, params.grid.boundary)));
    }
  }
  reset();
}

FieldBank& FieldBank::operator=(const FieldBank& other) {
  lattice_ = other.lattice_;
  interpolation_ = other.interpolation_;
  walls_ = other.walls_;
  engine_ = other.engine_;
  priors_ = other.priors_;
  version_ = other.version_;
  fields_.clear();
  for (const FieldMixture& from : other.fields_) {
    FieldMixture to;
    to.info = from.info;
    to.mean = from.mean;
    to.trend = from.trend;
    to.noise_variance = from.noise_variance;
    to.nugget_variance = from.nugget_variance;
    to.thetas = from.thetas;
    to.prior = from.prior;
    to.prior_variance = from.prior_variance;
    to.probability = from.probability;
    for (const auto& given : from.given) to.given.push_back(given->clone());
    fields_.push_back(std::move(to));
  }
  return *this;
}

void FieldBank::reset() {
  for (std::size_t f = 0; f < fields_.size(); ++f) {
    fields_[f].probability = fields_[f].prior;
    fields_[f].given.clear();
    for (const auto& prior : priors_[f]) fields_[f].given.push_back(prior->clone());
  }
  changed();
}

void FieldBank::focus(const std::vector<int>& sites, const std::vector<int>& ahead) {
  bool moved = false;
  for (FieldMixture& field : fields_) {
    for (const auto& given : field.given) moved = given->focus(sites, ahead) || moved;
  }
  if (moved) changed();
}

SiteRow FieldBank::row(const Eigen::Vector2d& point) const {
  return lattice_.contains(point) ? row_within(*walls_, lattice_, point, interpolation_)
                                  : SiteRow{};
}

Eigen::VectorXd FieldMixture::site_mean() const {
  Eigen::VectorXd mean = probability[0] * given[0]->mean();
  for (std::size_t l = 1; l < given.size(); ++l) {
    mean += probability[static_cast<Eigen::Index>(l)] * given[l]->mean();
  }
  return mean;
}

void FieldBank::assimilate(const Observation& z, const Eigen::Vector2d& place) {
  const SiteRow at = row(place);
  if (at.count == 0) return;
  FieldMixture& field = fields_[static_cast<std::size_t>(z.field)];
  const double residual = z.value - field.prior_mean(place);
  if (needs_focus()) {
    const std::vector<int> sites(at.site.begin(), at.site.begin() + at.count);
    focus(sites, sites);
  }
  Eigen::VectorXd logs = field.probability.array().log();
  MixtureUpdate update;
  update.clear(1);
  for (std::size_t l = 0; l < field.given.size(); ++l) {
    double mean = 0.0, variance = 0.0;
    field.given[l]->predict(&at, 1, &mean, &variance);
    update.clear(1);
    update.add(at, 1.0, residual - mean, variance + z.noise);
    logs[static_cast<Eigen::Index>(l)] += log_normal(residual - mean, variance + z.noise);
    field.given[l]->condition(update);
  }
  exponentiate_and_normalize(logs);
  field.probability = logs.cwiseMax(kSmallestProbability);
  field.probability /= field.probability.sum();
  changed();
}

field_core::FieldPrediction FieldBank::predict(const Eigen::Matrix2Xd& points) const {
  const auto count = static_cast<Eigen::Index>(fields_.size());
  field_core::FieldPrediction out{Eigen::MatrixXd::Zero(count, points.cols()),
                                  Eigen::MatrixXd::Zero(count, points.cols()),
                                  Eigen::VectorXd::Zero(count)};
  std::vector<SiteRow> rows;
  rows.reserve(static_cast<std::size_t>(points.cols()));
  for (Eigen::Index i = 0; i < points.cols(); ++i) rows.push_back(row(points.col(i)));
  Eigen::ArrayXd mean(points.cols()), variance(points.cols());
  for (Eigen::Index f = 0; f < count; ++f) {
    const FieldMixture& field = fields_[static_cast<std::size_t>(f)];
    Eigen::ArrayXd first = Eigen::ArrayXd::Zero(points.cols()), second = first;
    for (std::size_t l = 0; l < field.given.size(); ++l) {
      field.given[l]->survey(rows.data(), static_cast<int>(rows.size()), mean.data(),
                             variance.data());
      for (Eigen::Index i = 0; i < points.cols(); ++i) {
        if (rows[static_cast<std::size_t>(i)].count == 0) variance[i] = field.prior_variance[l];
      }
      const double w = field.probability[static_cast<Eigen::Index>(l)];
      first += w * mean;
      second += w * (variance + mean.square());
      out.prior_variance[f] += field.prior[static_cast<Eigen::Index>(l)] * field.prior_variance[l];
    }
    const double noise = field.noise_variance + field.nugget_variance;
    out.variance.row(f) = (second - first.square()).max(0.0) + noise;
    out.prior_variance[f] += noise;
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      out.mean(f, i) = field.prior_mean(points.col(i)) + first[i];
    }
  }
  return out;
}

namespace {
constexpr const char* kWallsBlock = "walls";

std::string block(std::size_t f, std::size_t l) {
  return "field" + std::to_string(f) + "/theta" + std::to_string(l) + "/";
}

/// One row per site: its edge along x, along y. 1: cut.
Eigen::MatrixXd wall_block(const Walls& walls) {
  using Bytes = Eigen::Map<const Eigen::Matrix<unsigned char, Eigen::Dynamic, 1>>;
  const auto n = static_cast<Eigen::Index>(walls.right.size());
  Eigen::MatrixXd cut(n, 2);
  cut << Bytes(walls.right.data(), n).cast<double>(), Bytes(walls.up.data(), n).cast<double>();
  return cut;
}

/// The fields of a state hold only with the walls that they were learned with.
void require_same_walls(const field_core::State& state, const Walls& walls) {
  const auto theirs = state.numbers().find(kWallsBlock);
  const bool had = theirs != state.numbers().end();
  if (!had && walls.empty()) return;
  if (had && !walls.empty() && theirs->second == wall_block(walls)) return;
  const std::string what = !had            ? "without walls, this run has some"
                           : walls.empty() ? "with walls, this run has none"
                                           : "with other walls";
  throw field_core::DataError("the state was learned " + what +
                              "; set use_map_topic and give the map that it was learned with");
}
}  // namespace

void FieldBank::save(field_core::State& state) const {
  if (!walls_->empty()) state.set(kWallsBlock, wall_block(*walls_));
  for (std::size_t f = 0; f < fields_.size(); ++f) {
    state.set("field" + std::to_string(f) + "/probability", fields_[f].probability);
    for (std::size_t l = 0; l < fields_[f].given.size(); ++l) {
      fields_[f].given[l]->save(state, block(f, l));
    }
  }
}

void FieldBank::restore(const field_core::State& state) {
  require_same_walls(state, *walls_);
  FieldBank next(*this);
  for (std::size_t f = 0; f < fields_.size(); ++f) {
    next.fields_[f].probability =
        state.matrix("field" + std::to_string(f) + "/probability", fields_[f].hypotheses(), 1);
    for (std::size_t l = 0; l < fields_[f].given.size(); ++l) {
      next.fields_[f].given[l]->restore(state, block(f, l));
    }
  }
  *this = std::move(next);
  changed();
}

}  // namespace gmrf_slap
