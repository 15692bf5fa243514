#include "field_ros/diagnostics.hpp"

#include <cmath>
#include <cstdio>

namespace field_ros {
namespace {

using diagnostic_msgs::DiagnosticStatus;

constexpr double kHighNis = 3.0;
constexpr double kLowNis = 0.1;
constexpr std::uint64_t kEnoughForNis = 30;

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

void add(DiagnosticStatus& status, const std::string& key, const std::string& value) {
  diagnostic_msgs::KeyValue item;
  item.key = key;
  item.value = value;
  status.values.push_back(item);
}

void raise(DiagnosticStatus& status, std::int8_t level, const std::string& message) {
  if (level < status.level) return;
  // The first problem of the highest level is the one to read.
  if (level > status.level) status.message = message;
  status.level = level;
}

const char* text_of(const std::string& drop) {
  for (int i = 0; i <= static_cast<int>(DropReason::numerical_error); ++i) {
    const auto reason = static_cast<DropReason>(i);
    if (drop == drop_name(reason)) return drop_text(reason);
  }
  return "";
}

std::string seconds(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.0f s", value);
  return text;
}

// The drop reason that grew most between two reports; "" if none did.
std::string main_drop(const Counts& before, const Counts& now) {
  std::string worst;
  std::uint64_t most = 0;
  for (const auto& [reason, count] : now) {
    const auto old = before.find(reason);
    const std::uint64_t grown = count - (old == before.end() ? 0 : old->second);
    if (grown <= most) continue;
    most = grown;
    worst = reason;
  }
  return worst;
}

void judge_arrival(DiagnosticStatus& status, const char* what, std::uint64_t count, double since,
                   const HealthSnapshot& now) {
  const std::string topic = std::string(what) == "odometry" ? "odom" : "field";
  if (since > now.input_timeout_s) {
    raise(status, DiagnosticStatus::STALE,
          std::string("no ") + what + " for " + seconds(since) + "; check the topic " + topic);
  } else if (count == 0) {
    raise(status, DiagnosticStatus::WARN,
          std::string("no ") + what + " yet; check the topic " + topic);
  }
}

void judge_input(DiagnosticStatus& status, const HealthSnapshot& before,
                 const HealthSnapshot& now) {
  judge_arrival(status, "odometry", now.counts.odometry, now.since_odometry_s, now);
  judge_arrival(status, "measurement", now.counts.measurements, now.since_measurement_s, now);
  const std::string reason = main_drop(before.counts.dropped, now.counts.dropped);
  const bool silent = status.level == DiagnosticStatus::STALE;
  if (now.waiting_for_transform > 0 && now.since_step_s > 1.0 && !silent) {
    raise(
        status, DiagnosticStatus::WARN,
        "measurements wait for the transform from their header.frame_id to base_frame_id; publish "
        "it on /tf_static");
  }
  if (!now.paused && !silent && !reason.empty() && now.since_step_s > now.input_timeout_s) {
    raise(status, DiagnosticStatus::ERROR,
          "no measurement could be used for " + seconds(now.since_step_s) + ", dropped: " + reason +
              ": " + text_of(reason));
  } else if (!now.paused && !reason.empty()) {
    // A dropped message says more than a missing one.
    if (status.level == DiagnosticStatus::WARN) status.level = DiagnosticStatus::OK;
    raise(status, DiagnosticStatus::WARN, "dropped: " + reason + ": " + text_of(reason));
  }
}

DiagnosticStatus input_status(const std::string& name, const HealthSnapshot& before,
                              const HealthSnapshot& now) {
  const double elapsed = std::max(1e-9, now.time_s - before.time_s);
  const SessionCounts &c = now.counts, &b = before.counts;
  DiagnosticStatus status;
  status.name = name + ": input";
  status.message = "OK";
  judge_input(status, before, now);
  add(status, "odometry rate [Hz]", number(static_cast<double>(c.odometry - b.odometry) / elapsed));
  add(status, "measurement rate [Hz]",
      number(static_cast<double>(c.measurements - b.measurements) / elapsed));
  add(status, "odometry messages", std::to_string(c.odometry));
  add(status, "measurement messages", std::to_string(c.measurements));
  add(status, "waiting for odometry", std::to_string(now.pending));
  add(status, "waiting for a transform", std::to_string(now.waiting_for_transform));
  add(status, "unknown field names", std::to_string(c.unknown_fields));
  add(status, "clock resets", std::to_string(c.clock_resets));
  for (const auto& [reason, count] : c.dropped)
    add(status, "dropped " + reason, std::to_string(count));
  return status;
}

void judge_nis(DiagnosticStatus& status, const HealthSnapshot& now) {
  const std::uint64_t dof = now.counts.nis_dof_sum;
  if (dof == 0) return;
  const double ratio = now.counts.nis_sum / static_cast<double>(dof);
  add(status, "NIS per degree of freedom (1 is ideal)", number(ratio));
  add(status, "NIS per degree of freedom, recent", number(now.recent_nis));
  if (dof < kEnoughForNis) return;
  if (ratio > kHighNis) {
    raise(
        status, DiagnosticStatus::WARN,
        "measurements differ from the map far more than expected; raise the fields' noise, or the "
        "pose is wrong");
  } else if (ratio < kLowNis) {
    raise(status, DiagnosticStatus::WARN,
          "measurements differ from the map far less than expected; lower the fields' noise");
  }
}

DiagnosticStatus estimator_status(const std::string& name, const HealthSnapshot& before,
                                  const HealthSnapshot& now) {
  const SessionCounts &c = now.counts, &b = before.counts;
  DiagnosticStatus status;
  status.name = name + ": estimator";
  status.message = now.paused ? "paused" : "OK";
  if (c.numerical_errors > b.numerical_errors) {
    raise(status, DiagnosticStatus::ERROR, now.last_error);
  }
  if (now.health.lost) {
    raise(status, DiagnosticStatus::ERROR,
          std::string("lost: ") + now.health.reason +
              "; give the pose (/initialpose), call global_localization, or set recovery: true");
  }
  if (!now.paused && now.since_step_s > now.input_timeout_s) {
    raise(status, DiagnosticStatus::STALE,
          "no measurement used for " + seconds(now.since_step_s) + ": the pose is odometry alone");
  }
  if (!now.save_problem.empty()) {
    raise(status, DiagnosticStatus::WARN, "the state is not saved: " + now.save_problem);
  }
  add(status, "steps", std::to_string(c.steps));
  add(status, "applied", std::to_string(c.applied));
  for (const auto& [reason, count] : c.skipped)
    add(status, "skipped " + reason, std::to_string(count));
  for (const auto& [reason, count] : c.noted) add(status, "noted " + reason, std::to_string(count));
  add(status, "lost", now.health.lost ? now.health.reason : "no");
  if (now.health.paths_left > 0.0) {
    add(status, "past paths left to the particles", number(now.health.paths_left));
  }
  add(status, "steps while lost", std::to_string(c.lost));
  add(status, "recoveries", std::to_string(c.recoveries));
  add(status, "states saved", std::to_string(now.states_saved));
  add(status, "numerical errors", std::to_string(c.numerical_errors));
  if (!now.last_error.empty()) add(status, "last numerical error", now.last_error);
  if (c.steps > b.steps) {
    add(status, "step time, mean [s]",
        number((now.step_time_sum_s - before.step_time_sum_s) /
               static_cast<double>(c.steps - b.steps)));
    add(status, "step time, largest [s]", number(now.step_time_max_s));
  }
  judge_nis(status, now);
  add(status, "x [m]", number(now.belief.mean.x()));
  add(status, "y [m]", number(now.belief.mean.y()));
  add(status, "yaw [rad]", number(now.belief.mean.yaw()));
  const Eigen::Vector3d stddev = now.belief.covariance.diagonal().cwiseSqrt();
  add(status, "stddev x [m]", number(stddev.x()));
  add(status, "stddev y [m]", number(stddev.y()));
  add(status, "stddev yaw [rad]", number(stddev.z()));
  return status;
}

}  // namespace

diagnostic_msgs::DiagnosticArray diagnose(const std::string& name, const HealthSnapshot& before,
                                          const HealthSnapshot& now) {
  diagnostic_msgs::DiagnosticArray out;
  out.status = {input_status(name, before, now), estimator_status(name, before, now)};
  for (auto& status : out.status) status.hardware_id = "none";
  return out;
}

}  // namespace field_ros
