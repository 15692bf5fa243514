// Where on a known map is the robot? Particles all over it, until they agree.
#pragma once

#include <optional>
#include <vector>

#include "field_core/odometry_motion_model.hpp"
#include "field_core/random.hpp"
#include "vector_field_slam/localize_solver.hpp"

namespace vector_field_slam {

/// Monte Carlo localization over the known cells (Probabilistic Robotics, table 8.2): the pose that
/// global_localization asks for. O(particles) per step.
class Relocalization {
 public:
  Relocalization(const std::vector<ChannelModel>& channels, const GridGeometry<double>& grid,
                 const field_core::OdometryMotionModel& motion, int particles);

  /// Poses drawn evenly over the cells of the map. @return false if it has none
  bool scatter(const Solver& map, field_core::Random& random);
  bool active() const { return !particles_.empty(); }
  void stop() { particles_.clear(); }

  void move(const field_core::SE2& delta, field_core::Random& random);
  /// Weighs by the readings, and resamples. @return the pose once the particles agree on one place
  std::optional<field_core::Belief> observe(const Solver& map, const Mounting<double>& mounting,
                                            const Observation<double>* observations, int count,
                                            field_core::Random& random);
  field_core::Belief belief(field_core::Stamp stamp) const;

  void save(field_core::State& state) const;
  void restore(const field_core::State& state);

 private:
  double log_likelihood(const Solver& map, const field_core::SE2& pose,
                        const Mounting<double>& mounting, const Observation<double>* observations,
                        int count) const;
  void resample(field_core::Random& random);

  AnySensor sensor_;
  GridGeometry<double> grid_;
  field_core::OdometryMotionModel motion_;
  int wanted_;
  std::vector<field_core::WeightedPose> particles_, resampled_;
};

}  // namespace vector_field_slam
