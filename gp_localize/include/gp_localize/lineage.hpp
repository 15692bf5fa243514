// What resampling has left of the particles' pasts: a map per particle is only as good as the paths
// that are still there to choose from.
#pragma once

#include <vector>

#include "field_core/state.hpp"
#include "gp_localize/map_model.hpp"
#include "gp_localize/params.hpp"

namespace gp_localize {

/// Remembers of every particle its ancestors when the current period of `horizon` updates began and
/// when the one before it did. All calls are O(particles) and allocate nothing.
class Lineage {
 public:
  /// @param most the largest number of particles
  Lineage(const DiversityParams& params, int most);

  /// From now on every particle has a past of its own.
  void restart(std::size_t particles);
  /// Particle i is now a copy of particle ancestors[i].
  void resampled(const std::vector<int>& ancestors);
  /// After each update. `unknown`, 0 to 1: how much of what was read had to be learned on the way.
  void step(double unknown = 1.0);

  /// Effective number of the paths of `horizon` to twice as many updates ago (or of the start, if
  /// that is more recent) that are left: 1 / the sum over paths of the squared weight of their
  /// particles. Weights are normalized.
  double paths_left(const ParticleSet& particles) const;
  /// Power of the likelihood that lets paths live: 1 while there are enough, else their share of
  /// what is wanted. That is never more than a quarter of the particles, and less where less had to
  /// be learned: a map from before the run rests on none of these paths.
  double tempering(const ParticleSet& particles) const;

  void save(field_core::State& state) const;
  /// @throws field_core::DataError unless the state's lineage is one of so many particles, at most
  ///         as many as there may be here
  void restore(const field_core::State& state, std::size_t particles);

 private:
  struct Period {
    double updates = 0.0, unknown = 0.0;  // their number, and the sum over them
  };
  /// Mean over the updates since the paths that are counted.
  double unknown() const;

  DiversityParams params_;
  Period period_, before_;         // the current one and the one before it
  std::vector<int> recent_, old_;  // per particle, numbers of ancestors
  std::vector<int> scratch_;
  mutable std::vector<double> weights_;  // of old paths
};

}  // namespace gp_localize
