#include "gp_localize/map_model.hpp"

#include <cmath>

#include "dense_path_bank.hpp"
#include "field_core/errors.hpp"
#include "particle_map.hpp"
#include "sample_path_map.hpp"
#include "sparse_path_bank.hpp"

namespace gp_localize {

Eigen::Matrix<double, kStateSize, 1> pack(const RobotState& s) {
  Eigen::Matrix<double, kStateSize, 1> numbers;
  numbers << s.pose.vector(), s.calibration.translation, s.calibration.rotation,
      s.calibration.drift;
  return numbers;
}

RobotState unpack(const Eigen::Matrix<double, kStateSize, 1>& n) {
  return {field_core::SE2(n[0], n[1], n[2]), {n[3], n[4], n[5]}};
}

RobotState MotionModel::draw(const field_core::SE2& mean, const Eigen::Matrix3d& covariance,
                             field_core::Random& random) const {
  const field_core::SE2 pose(mean.vector() + random.normal3(covariance));
  return {pose, calibration.draw(random)};
}

void MotionModel::move(const field_core::OdometryMotion& reported, RobotState& state,
                       field_core::Random& random) const {
  state.pose = odometry.sample(state.pose, state.calibration.correct(reported), random);
  calibration.wander(std::abs(reported.trans), state.calibration, random);
}

void PathBank::add_joint(const Places&, const std::vector<Reading>&, PathBank&,
                         std::vector<Eigen::Matrix2Xd>&) {
  throw field_core::ParameterError(
      "observation_model",
      "knows no coregionalization; use online_pitc, online_pitc_assimilated or fitc");
}

std::unique_ptr<PathBank> make_path_bank(const GpLocalizeParams& params, const FieldModel& field) {
  switch (params.observation_model) {
    case ObservationModelType::online_pitc:
    case ObservationModelType::online_pitc_assimilated: {
      const bool recent = params.observation_model == ObservationModelType::online_pitc;
      return std::make_unique<SparsePathBank>(field, params.sample_paths, params.slice_size,
                                              recent ? Recent::used : Recent::ignored,
                                              params.precision, params.interpolation_tolerance);
    }
    case ObservationModelType::fitc:
      return std::make_unique<SparsePathBank>(field, params.sample_paths, 1, Recent::used,
                                              params.precision, params.interpolation_tolerance);
    default:
      return std::make_unique<DensePathBank>(field, params);
  }
}

std::unique_ptr<MapModel> make_map_model(const GpLocalizeParams& params,
                                         const std::vector<FieldModel>& fields) {
  if (params.map_hypotheses == MapHypotheses::particle) {
    return std::make_unique<ParticleMap>(params, fields);
  }
  return std::make_unique<SamplePathMap>(params, fields);
}

}  // namespace gp_localize
