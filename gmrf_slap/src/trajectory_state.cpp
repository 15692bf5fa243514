// TrajectoryBelief as blocks of numbers. Factors are not stored: rebuilt from the same fields and
// rows they have the same bits.
#include "field_core/errors.hpp"
#include "trajectory_belief.hpp"

namespace gmrf_slap {
namespace {

using field_core::SE2;
constexpr Eigen::Index kEntry = 11;  // count, 4 sites, 4 weights, residual, noise

Eigen::MatrixXd pack(const SuffixProcess& process) {
  Eigen::MatrixXd out(kEntry, process.size());
  for (int i = 0; i < process.size(); ++i) {
    const SiteRow& row = process.row(i);
    out(0, i) = row.count;
    for (std::size_t a = 0; a < 4; ++a) {
      out(1 + static_cast<Eigen::Index>(a), i) = row.site[a];
      out(5 + static_cast<Eigen::Index>(a), i) = row.weight[a];
    }
    out(9, i) = process.residual(i);
    out(10, i) = process.noise(i);
  }
  return out;
}

SiteRow unpack(const Eigen::Ref<const Eigen::VectorXd>& entry, int sites) {
  SiteRow row;
  row.count = static_cast<int>(entry[0]);
  for (std::size_t a = 0; a < 4; ++a) {
    row.site[a] = static_cast<int>(entry[1 + static_cast<Eigen::Index>(a)]);
    row.weight[a] = entry[5 + static_cast<Eigen::Index>(a)];
    if (row.site[a] < 0 || row.site[a] >= sites || row.count < 0 || row.count > 4) {
      throw field_core::DataError("a trajectory of the state leaves the grid; it is damaged");
    }
  }
  return row;
}

}  // namespace

void TrajectoryBelief::save(field_core::State& state, const std::string& prefix) const {
  const auto count = static_cast<Eigen::Index>(count_);
  Eigen::MatrixXd poses(3, count), cloud(4, count);
  for (Eigen::Index p = 0; p < count; ++p) {
    const auto at = static_cast<std::size_t>(p);
    poses.col(p) = poses_[at].vector();
    cloud.col(p) << belief_.particles[at].pose.vector(), belief_.particles[at].weight;
  }
  state.set(prefix + "poses", poses);
  state.set(prefix + "log_weights", log_weights_);
  state.set(prefix + "cloud", cloud);
  state.set(prefix + "mean", belief_.mean.vector());
  state.set(prefix + "covariance", belief_.covariance);
  state.set_text(prefix + "random", random_.state());
  const std::size_t fields = tracks_[0].size();
  Eigen::MatrixXd steps(fields, held_);
  for (std::size_t t = 0; t < held_; ++t) {
    for (std::size_t f = 0; f < fields; ++f) steps(f, t) = steps_[t][f];
  }
  state.set(prefix + "steps", steps);
  for (std::size_t f = 0; f < fields; ++f) {
    Eigen::MatrixXd tracks(kEntry * tracks_[0][f].size(), count);
    for (Eigen::Index p = 0; p < count; ++p) {
      const Eigen::MatrixXd one = pack(tracks_[static_cast<std::size_t>(p)][f]);
      tracks.col(p) = Eigen::Map<const Eigen::VectorXd>(one.data(), one.size());
    }
    state.set(prefix + "track" + std::to_string(f), tracks);
  }
}

void TrajectoryBelief::restore(const field_core::State& state, const std::string& prefix,
                               const FieldBank& bank) {
  const auto count = static_cast<Eigen::Index>(count_);
  const auto fields = static_cast<Eigen::Index>(tracks_[0].size());
  // Everything is read and checked before anything changes.
  const Eigen::MatrixXd poses = state.matrix(prefix + "poses", 3, count);
  const Eigen::MatrixXd log_weights = state.matrix(prefix + "log_weights", count, 1);
  const Eigen::MatrixXd cloud = state.matrix(prefix + "cloud", 4, count);
  const Eigen::MatrixXd mean = state.matrix(prefix + "mean", 3, 1);
  const Eigen::MatrixXd covariance = state.matrix(prefix + "covariance", 3, 3);
  const Eigen::MatrixXd steps = state.matrix(prefix + "steps", fields, -1);
  if (steps.cols() >= lag_) {
    throw field_core::DataError("the state holds " + std::to_string(steps.cols()) +
                                " measurements per trajectory, lag allows " +
                                std::to_string(lag_ - 1) + "; use the lag it was saved with");
  }
  field_core::Random random(0);
  random.restore(state.text(prefix + "random"));
  std::vector<Track> tracks = tracks_;
  for (Eigen::Index f = 0; f < fields; ++f) {
    const auto entries = static_cast<Eigen::Index>(steps.row(f).sum());
    const Eigen::MatrixXd& packed =
        state.matrix(prefix + "track" + std::to_string(f), kEntry * entries, count);
    for (Eigen::Index p = 0; p < count; ++p) {
      SuffixProcess& process = tracks[static_cast<std::size_t>(p)][static_cast<std::size_t>(f)];
      process.clear();
      for (Eigen::Index i = 0; i < entries; ++i) {
        const Eigen::VectorXd entry = packed.col(p).segment(kEntry * i, kEntry);
        process.append(unpack(entry, sites_), entry[9], entry[10]);
      }
    }
  }
  tracks_ = std::move(tracks);
  random_ = random;
  log_weights_ = log_weights;
  for (Eigen::Index p = 0; p < count; ++p) {
    const auto at = static_cast<std::size_t>(p);
    poses_[at] = SE2(Eigen::Vector3d(poses.col(p)));
    belief_.particles[at] = {SE2(Eigen::Vector3d(cloud.col(p).head<3>())), cloud(3, p)};
  }
  belief_.mean = SE2(Eigen::Vector3d(mean));
  belief_.covariance = covariance;
  held_ = static_cast<std::size_t>(steps.cols());
  for (Eigen::Index t = 0; t < steps.cols(); ++t) {
    for (Eigen::Index f = 0; f < fields; ++f) {
      steps_[static_cast<std::size_t>(t)][static_cast<std::size_t>(f)] = steps(f, t) > 0.0;
    }
  }
  normalize_weights();
  version_ = bank.version() + 1;  // not followed yet
  follow(bank);
}

}  // namespace gmrf_slap
