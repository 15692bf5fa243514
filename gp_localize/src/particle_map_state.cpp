// Saving and restoring the maps of all particles.
#include <algorithm>

#include "field_core/errors.hpp"
#include "particle_map.hpp"

namespace gp_localize {
namespace {

void require_below(const Eigen::MatrixXd& indices, double count, const std::string& block) {
  if (indices.minCoeff() >= 0.0 && indices.maxCoeff() < count) return;
  throw field_core::DataError("the state's block '" + block +
                              "' names what does not exist; the state file is damaged");
}

}  // namespace

void ParticleMap::save(field_core::State& state) const {
  const auto particles = static_cast<Eigen::Index>(map_.size());
  const auto maps = static_cast<Eigen::Index>(closed_.size());
  state.set("steps_in_slice", steps_in_slice_);
  Eigen::MatrixXd map(1, particles);
  for (Eigen::Index p = 0; p < particles; ++p) map(0, p) = map_[p];
  state.set("map_of_particle", map);
  Eigen::MatrixXd candidates(static_cast<Eigen::Index>(first_.size()), particles);
  for (Eigen::Index i = 0; i < candidates.size(); ++i) candidates.data()[i] = candidate_[i];
  state.set("candidate_of_particle", candidates);
  offsets_.save(state);
  factors_.save(state);
  map_error_.save(state);
  Eigen::MatrixXd grown = Eigen::MatrixXd::Zero(2, 1 + grown_support().cols());
  grown.rightCols(grown.cols() - 1) = grown_support();  // after a column that is never empty
  state.set("grown_support", grown);
  for (std::size_t g = 0; g < first_.size(); ++g) {
    const std::string& name = fields_[first_[g]].info.name;
    const int m = static_cast<int>(fields_[first_[g]].basis.size());
    Eigen::MatrixXd closed = Eigen::MatrixXd::Zero(SupportPosterior::size(m), maps);
    for (Eigen::Index i = 0; i < maps; ++i) {
      if (users_[i] == 0) continue;
      closed.col(i) = Eigen::Map<const Eigen::VectorXd>(closed_[i][g].numbers(), closed.rows());
    }
    Eigen::MatrixXd open(slices_.front()[g].numbers().size() + 1, particles);
    for (Eigen::Index p = 0; p < particles; ++p) {
      const OpenSlice& slice = slices_[slice_[p]][g];
      open(0, p) = slice.open();
      open.col(p).tail(open.rows() - 1) =
          Eigen::Map<const Eigen::VectorXd>(slice.numbers().data(), open.rows() - 1);
    }
    state.set("map/" + name, closed);
    Eigen::MatrixXd known = Eigen::MatrixXd::Zero(closed.rows(), 1 + known_.size());
    for (std::size_t i = 0; i < known_.size(); ++i) {  // after a column that is always there
      known.col(1 + i) = Eigen::Map<const Eigen::VectorXd>(known_[i][g].numbers(), known.rows());
    }
    state.set("known/" + name, known);
    state.set("slice/" + name, open);
  }
}

void ParticleMap::restore(const field_core::State& state, const std::vector<int>& ancestors) {
  const Eigen::MatrixXd map = state.matrix("map_of_particle", 1, -1);
  const int steps = static_cast<int>(state.scalar("steps_in_slice"));
  const auto rows = static_cast<Eigen::Index>(first_.size());
  const Eigen::MatrixXd candidate = state.matrix("candidate_of_particle", rows, map.cols());
  const auto most = static_cast<double>(candidates_.front().size());
  require_below(candidate, most, "candidate_of_particle");
  std::vector<const Eigen::MatrixXd*> closed, open, known;
  for (std::size_t g = 0; g < first_.size(); ++g) {  // a group has the name of its first field
    const FieldModel& field = fields_[first_[g]];
    const int m = static_cast<int>(field.basis.size());
    closed.push_back(&state.matrix("map/" + field.info.name, SupportPosterior::size(m), -1));
    known.push_back(&state.matrix("known/" + field.info.name, SupportPosterior::size(m),
                                  known.empty() ? -1 : known.front()->cols()));
    const auto numbers = static_cast<Eigen::Index>(slices_.front()[g].numbers().size());
    open.push_back(&state.matrix("slice/" + field.info.name, numbers + 1, map.cols()));
    require_below(map, static_cast<double>(closed.back()->cols()), "map_of_particle");
  }
  const Eigen::MatrixXd& grown = state.matrix("grown_support", 2, -1);
  const SupportBasis& basis = fields_.front().basis;
  if (first_support_ + grown.cols() - 1 > basis.size() / basis.fields()) {
    throw field_core::DataError("the state has " + std::to_string(grown.cols() - 1) +
                                " support points that were added; raise support/budget");
  }
  MapError map_error = map_error_;
  FieldOffsets offsets = offsets_;
  VarianceFactors factors = factors_;
  map_error.restore(state);
  offsets.restore(state, ancestors);
  factors.restore(state, ancestors);  // the last that can fail
  map_error_ = map_error;
  offsets_ = offsets;
  factors_ = factors;
  known_.assign(known.front()->cols() > 1 ? 1 : 0, closed_.front());
  for (std::size_t g = 0; g < first_.size() && !known_.empty(); ++g) {
    std::copy_n(known[g]->col(1).data(), known[g]->rows(), known_.front()[g].numbers());
  }
  forget_grown_support();
  for (Eigen::Index i = 1; i < grown.cols(); ++i) grow_all(grown.col(i));
  // Maps that particles share are taken over once: `place` is where each is now.
  std::vector<int> place(closed.front()->cols(), -1);
  int maps = 0;
  map_.resize(ancestors.size());
  slice_.resize(ancestors.size());
  candidate_.resize(ancestors.size() * first_.size());
  for (std::size_t p = 0; p < ancestors.size(); ++p) {
    const int from = static_cast<int>(map(0, ancestors[p]));
    const bool is_new = place[from] < 0;
    if (is_new) place[from] = maps++;
    map_[p] = place[from];
    slice_[p] = static_cast<int>(p);
    for (std::size_t g = 0; g < first_.size(); ++g) {
      candidate_[p * first_.size() + g] = static_cast<int>(candidate(g, ancestors[p]));
      if (is_new) {
        const auto numbers = closed[g]->col(from);
        std::copy(numbers.data(), numbers.data() + numbers.size(), closed_[map_[p]][g].numbers());
      }
      const double* slice = open[g]->col(ancestors[p]).data();
      slices_[p][g].restore(static_cast<int>(slice[0]), slice + 1);
    }
  }
  recount_users();
  steps_in_slice_ = steps;
}

}  // namespace gp_localize
