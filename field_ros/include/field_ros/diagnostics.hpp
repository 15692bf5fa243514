// A session's health as diagnostic messages.
#pragma once

#include <diagnostic_msgs/DiagnosticArray.h>

#include <string>

#include "field_ros/session.hpp"

namespace field_ros {

/// What diagnostics report about, at one time.
struct HealthSnapshot {
  double time_s = 0.0;  ///< of a steady clock, as all times here
  SessionCounts counts;
  double step_time_sum_s = 0.0;
  double step_time_max_s = 0.0;   ///< since the report before
  double since_odometry_s = 0.0;  ///< since the last message, or the start of the node
  double since_measurement_s = 0.0;
  double since_step_s = 0.0;
  double input_timeout_s = 5.0;
  field_core::Belief belief;
  field_core::Health health;
  double recent_nis = 0.0;  ///< per degree of freedom, of the last lost_window measurements
  std::size_t pending = 0;
  std::size_t waiting_for_transform = 0;
  std::uint64_t states_saved = 0;
  std::string save_problem;
  bool paused = false;
  std::string last_error;
};

/// Two statuses, "<name>: input" and "<name>: estimator", each with its counts and one text that
/// says what to do about the worst that is the case.
///
/// input      OK: messages come and are used. WARN: some were dropped since the report before, or
///            none has come yet. ERROR: measurements come, none could be used for input_timeout.
///            STALE: no odometry or no measurement for input_timeout.
/// estimator  OK: the belief agrees with the measurements, or paused on purpose. WARN: NIS over the
///            whole run above 3 or below 1/10, automatic saving failed. ERROR: lost; numerical
///            errors since the report before. STALE: no step for input_timeout, the pose is
///            odometry alone.
diagnostic_msgs::DiagnosticArray diagnose(const std::string& name, const HealthSnapshot& before,
                                          const HealthSnapshot& now);

}  // namespace field_ros
