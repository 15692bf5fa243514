// A session's health as diagnostic messages.
#pragma once

#include <diagnostic_msgs/DiagnosticArray.h>

#include <string>

#include "field_ros/session.hpp"

namespace field_ros {

/// What diagnostics report about, at one time.
struct HealthSnapshot {
  double time_s = 0.0;  ///< of a steady clock
  SessionCounts counts;
  double step_time_sum_s = 0.0;
  double step_time_max_s = 0.0;  ///< since the report before
  field_core::Belief belief;
  std::size_t pending = 0;
  bool paused = false;
  field_core::Health health;
  std::string last_error;
};

/// Two states, "<name>: input" and "<name>: estimator". WARN: messages were dropped since the
/// report before, no odometry, or innovations more than 3 times (or less than 1/10) of what the
/// filter expects, or the estimator says that it is lost; ERROR: numerical errors since the report
/// before. Each text says what to do.
diagnostic_msgs::DiagnosticArray diagnose(const std::string& name, const HealthSnapshot& before,
                                          const HealthSnapshot& now);

}  // namespace field_ros
