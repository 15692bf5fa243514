// Errors of a trajectory against the truth. For dead reckoning see dead_reckoning.cpp.
#include "field_core/metrics.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "field_core/errors.hpp"

namespace field_core {
namespace {

struct Pairs {
  std::vector<Stamp> stamps;
  std::vector<SE2> truth, estimate;
  std::vector<const std::optional<Eigen::Matrix3d>*> covariances;
};

Pairs pair_by_stamp(const Trajectory& truth, const Trajectory& estimate) {
  Pairs pairs;
  for (const auto& pose : estimate) {
    const auto true_pose = pose_at(truth, pose.stamp);
    if (!true_pose) continue;
    pairs.stamps.push_back(pose.stamp);
    pairs.truth.push_back(*true_pose);
    pairs.estimate.push_back(pose.pose);
    pairs.covariances.push_back(&pose.covariance);
  }
  if (!pairs.stamps.empty()) return pairs;
  const auto span = [](const Trajectory& t) {
    return t.empty() ? std::string("nothing")
                     : format_stamp(t.front().stamp) + " .. " + format_stamp(t.back().stamp) + " s";
  };
  throw DataError("the stamps have nothing in common: truth " + span(truth) + ", estimate " +
                  span(estimate) + "; both must be stamped by the same clock");
}

// Least squares over positions; in the plane Umeyama's rotation has this closed form.
SE2 best_alignment(const Pairs& pairs) {
  Eigen::Vector2d truth_mean = Eigen::Vector2d::Zero(), estimate_mean = Eigen::Vector2d::Zero();
  const auto count = static_cast<double>(pairs.truth.size());
  for (std::size_t i = 0; i < pairs.truth.size(); ++i) {
    truth_mean += pairs.truth[i].translation() / count;
    estimate_mean += pairs.estimate[i].translation() / count;
  }
  double dot = 0.0, cross = 0.0;
  for (std::size_t i = 0; i < pairs.truth.size(); ++i) {
    const Eigen::Vector2d t = pairs.truth[i].translation() - truth_mean;
    const Eigen::Vector2d e = pairs.estimate[i].translation() - estimate_mean;
    dot += e.dot(t);
    cross += e.x() * t.y() - e.y() * t.x();
  }
  const SE2 turn(0.0, 0.0, dot == 0.0 && cross == 0.0 ? 0.0 : std::atan2(cross, dot));
  const Eigen::Vector2d shift = truth_mean - turn * estimate_mean;
  return SE2(shift.x(), shift.y(), turn.yaw());
}

SE2 alignment_of(const Pairs& pairs, Alignment alignment) {
  switch (alignment) {
    case Alignment::none:
      return SE2();
    case Alignment::first:
      return pairs.truth.front() * pairs.estimate.front().inverse();
    case Alignment::best:
      return best_alignment(pairs);
  }
  throw DataError("the alignment is none of none, first, best");
}

void absolute_errors(const Pairs& pairs, TrajectoryErrors& errors) {
  std::vector<double> yaws;
  for (std::size_t i = 0; i < pairs.truth.size(); ++i) {
    errors.position_errors.push_back(
        (pairs.estimate[i].translation() - pairs.truth[i].translation()).norm());
    yaws.push_back(std::abs(wrap_angle(pairs.estimate[i].yaw() - pairs.truth[i].yaw())));
  }
  errors.position = error_statistics(errors.position_errors);
  errors.yaw = error_statistics(yaws);
}

// Each pose against the first one that lies relative_distance of driven path ahead.
void relative_errors(const Pairs& pairs, double relative_distance, TrajectoryErrors& errors) {
  std::vector<double> driven = {0.0};
  for (std::size_t i = 1; i < pairs.truth.size(); ++i) {
    driven.push_back(driven.back() +
                     (pairs.truth[i].translation() - pairs.truth[i - 1].translation()).norm());
  }
  if (relative_distance <= 0.0) relative_distance = 0.1 * driven.back();
  errors.relative_distance = relative_distance;
  std::vector<double> positions, yaws;
  for (std::size_t i = 0, j = 0; relative_distance > 0.0 && i < driven.size(); ++i) {
    while (j < driven.size() && driven[j] - driven[i] < relative_distance) ++j;
    if (j == driven.size()) break;
    const SE2 difference = pairs.truth[i]
                               .between(pairs.truth[j])
                               .between(pairs.estimate[i].between(pairs.estimate[j]));
    positions.push_back(difference.translation().norm());
    yaws.push_back(std::abs(difference.yaw()));
  }
  errors.relative_position = error_statistics(positions);
  errors.relative_yaw = error_statistics(yaws);
}

void consistency(const Pairs& pairs, TrajectoryErrors& errors) {
  const double ellipse_90 =
      -2.0 * std::log(0.1);  // quantile of chi-square with 2 degrees of freedom
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn.topLeftCorner<2, 2>() = errors.alignment.rotation();
  double sum3 = 0.0, sum2 = 0.0;
  std::size_t inside = 0, count = 0;
  for (std::size_t i = 0; i < pairs.truth.size(); ++i) {
    if (!*pairs.covariances[i]) continue;
    const Eigen::Matrix3d covariance = turn * **pairs.covariances[i] * turn.transpose();
    const Eigen::LLT<Eigen::Matrix3d> factor(covariance);
    if (!covariance.allFinite() || factor.info() != Eigen::Success) {
      throw NumericalError(
          "the covariance at stamp " + format_stamp(pairs.stamps[i]) +
          " is not positive definite; correct the program that wrote it, or remove "
          "its cov_* columns");
    }
    const Eigen::Vector3d e(pairs.estimate[i].x() - pairs.truth[i].x(),
                            pairs.estimate[i].y() - pairs.truth[i].y(),
                            wrap_angle(pairs.estimate[i].yaw() - pairs.truth[i].yaw()));
    const Eigen::Matrix2d xy = covariance.topLeftCorner<2, 2>();
    const double distance2 = e.head<2>().dot(xy.llt().solve(e.head<2>()));
    sum3 += e.dot(factor.solve(e));
    sum2 += distance2;
    inside += distance2 <= ellipse_90;
    ++count;
  }
  if (count == 0) return;
  errors.nees = sum3 / static_cast<double>(count);
  errors.nees_position = sum2 / static_cast<double>(count);
  errors.share_inside_90_ellipse = static_cast<double>(inside) / static_cast<double>(count);
}

}  // namespace

TrajectoryErrors compare(const Trajectory& truth, const Trajectory& estimate, Alignment alignment,
                         double relative_distance) {
  Pairs pairs = pair_by_stamp(truth, estimate);
  TrajectoryErrors errors;
  errors.poses = pairs.stamps.size();
  errors.stamps = pairs.stamps;
  errors.alignment = alignment_of(pairs, alignment);
  for (auto& pose : pairs.estimate) pose = errors.alignment * pose;
  absolute_errors(pairs, errors);
  relative_errors(pairs, relative_distance, errors);
  consistency(pairs, errors);
  return errors;
}

}  // namespace field_core
