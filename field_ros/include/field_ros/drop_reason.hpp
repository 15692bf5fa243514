// Why a message was dropped: counted by reason in diagnostics and in the replay's summary.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace field_ros {

enum class DropReason {
  none,
  zero_stamp,
  non_finite_pose,
  bad_quaternion,
  unknown_frame,
  bad_covariance,
  empty_measurement,
  too_many_fields,
  length_mismatch,
  duplicate_field,
  infinite_value,
  negative_variance,
  no_known_field,
  nothing_observed,
  odometry_out_of_order,
  odometry_stray_stamp,
  before_odometry,
  older_than_processed,
  older_than_buffer,
  queue_full,
  shed,
  paused,
  numerical_error
};

/// snake_case name, stable: keys of summary.json and of /diagnostics.
const char* drop_name(DropReason reason);
/// One sentence for a person: what is wrong with the message and what to do.
const char* drop_text(DropReason reason);

using Counts = std::map<std::string, std::uint64_t>;

/// A value, or why there is none.
template <class T>
struct Checked {
  std::optional<T> value;
  DropReason reason = DropReason::none;

  Checked(T v) : value(std::move(v)) {}
  Checked(DropReason why) : reason(why) {}
  explicit operator bool() const { return value.has_value(); }
};

}  // namespace field_ros
