// Vector Field SLAM: Gutmann, Eade, Fong, Munich, "A Constant-Time Algorithm for Vector Field SLAM
// Using an Exactly Sparse Extended Information Filter", ICRA 2010.
#pragma once

#include <memory>
#include <vector>

#include "field_core/estimator.hpp"
#include "field_core/random.hpp"
#include "vector_field_slam/params.hpp"
#include "vector_field_slam/relocalization.hpp"
#include "vector_field_slam/solver.hpp"
#include "vector_field_slam/start.hpp"

namespace vector_field_slam {

/// The solver that params name. @throws field_core::ParameterError
std::unique_ptr<Solver> make_solver(const VectorFieldSlamParams& params,
                                    const std::vector<ChannelModel>& channels);

/// Meets the requirements of field_core/estimator.hpp. A step takes constant time with solver:
/// eseif, and allocates only where the map grows.
class VectorFieldSlam {
 public:
  using Params = VectorFieldSlamParams;
  static constexpr const char* kName = "vector_field_slam";
  static constexpr std::uint32_t kStateVersion = 2;

  VectorFieldSlam(const Params& params, std::uint64_t seed);

  void predict(const field_core::OdometryIncrement& increment);
  /// Skips: "no known channel", "not moved enough" (update_min_d, update_min_a), "first
  /// measurements" (start_measurements), "no map loaded" (localize_only), "searching the map"
  /// (after scatter), and what the solver leaves out. Notes: odometry that jumped since the last
  /// one, a background correction that is late.
  field_core::UpdateResult update(const field_core::Sample& sample);

  field_core::Belief belief() const;
  /// The field itself: what a sensor with yaw 0 and offset c = 0 would read, with the noise of one.
  field_core::FieldPrediction predict_field(const Eigen::Matrix2Xd& points) const;
  const std::vector<field_core::FieldInfo>& fields() const { return infos_; }
  field_core::MapRegion map_region() const;

  void set_pose(const field_core::SE2& mean, const Eigen::Matrix3d& covariance);
  /// Searches the map for the robot by relocalization_particles; does nothing while there is no
  /// map.
  void scatter();
  void reset();

  field_core::State state() const;
  void restore(const field_core::State& state);

  /// Replays wait for the background optimization, so that nothing depends on the machine.
  void wait_for_background() { wait_ = true; }

  field_core::Health health() const;
  static std::vector<std::string> run_parameters();

  /// Null before the first measurements are in.
  const Solver* solver() const { return started_ ? solver_.get() : nullptr; }

 private:
  bool moved_enough() const;
  bool believable(const field_core::OdometryIncrement& increment) const;
  OdometryStep<double> step_of(const field_core::OdometryIncrement& increment,
                               const field_core::SE2& pose) const;
  void collect_observations(const field_core::Sample& sample);
  field_core::UpdateResult start_with(const Mounting<double>& mounting);
  field_core::UpdateResult search(const Mounting<double>& mounting);
  bool astray() const;
  void give_up();
  void start_late_channels(const Mounting<double>& mounting);

  Params params_;
  std::vector<ChannelModel> channels_;
  std::vector<field_core::FieldInfo> infos_;
  GridGeometry<double> grid_;
  field_core::OdometryMotionModel motion_model_;
  std::uint64_t seed_;
  field_core::Random random_;
  Start start_;
  std::unique_ptr<Solver> solver_;
  Relocalization relocalization_;
  bool started_ = false, wait_ = false;
  std::vector<bool> seen_;  // channels that were ever observed
  int rejected_ = 0;        // measurements in a row outside the gate
  const char* note_ = "";   // what is to be told of the next measurement
  field_core::Stamp stamp_{0};
  bool updated_ = false;
  double moved_distance_ = 0.0, moved_angle_ = 0.0;  // since the last update
  std::vector<Observation<double>> observations_;    // of one sample; kept for its memory
};

static_assert(field_core::is_estimator_v<VectorFieldSlam>);

}  // namespace vector_field_slam
