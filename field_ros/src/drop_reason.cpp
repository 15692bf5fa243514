#include "field_ros/drop_reason.hpp"

namespace field_ros {
namespace {

struct Entry {
  DropReason reason;
  const char* name;
  const char* text;
};

constexpr Entry kEntries[] = {
    {DropReason::none, "none", "the message was used"},
    {DropReason::zero_stamp, "zero_stamp",
     "header.stamp is 0 although time has begun; stamp the message when it is measured"},
    {DropReason::non_finite_pose, "non_finite_pose",
     "the pose holds NaN or infinity; check its source"},
    {DropReason::bad_quaternion, "bad_quaternion",
     "the orientation is not a unit quaternion; normalize it"},
    {DropReason::unknown_frame, "unknown_frame",
     "the frame is not the configured one or tf does not know it; check odom_frame_id, "
     "base_frame_id, global_frame_id and the sensor's static transform"},
    {DropReason::bad_covariance, "bad_covariance",
     "the covariance is not finite, symmetric and positive semi-definite; check its source"},
    {DropReason::empty_measurement, "empty_measurement", "the measurement names no field"},
    {DropReason::too_many_fields, "too_many_fields",
     "the measurement holds more fields than max_fields_per_message"},
    {DropReason::length_mismatch, "length_mismatch",
     "names, values and variances differ in length (variances may be empty)"},
    {DropReason::duplicate_field, "duplicate_field", "the measurement names a field twice"},
    {DropReason::infinite_value, "infinite_value",
     "a value is infinite; send NaN for 'not observed'"},
    {DropReason::negative_variance, "negative_variance",
     "a variance is negative or not finite; send 0 for the configured noise"},
    {DropReason::no_known_field, "no_known_field",
     "no field of the measurement is configured; compare its names with the configuration"},
    {DropReason::nothing_observed, "nothing_observed", "all values are NaN"},
    {DropReason::odometry_out_of_order, "odometry_out_of_order",
     "odometry is not newer than the one before; check for two publishers"},
    {DropReason::odometry_stray_stamp, "odometry_stray_stamp",
     "a single odometry message had a stamp far from its neighbours"},
    {DropReason::before_odometry, "before_odometry",
     "the measurement is older than the first odometry"},
    {DropReason::older_than_processed, "older_than_processed",
     "a later measurement was already used; raise reorder_window if several sensors publish"},
    {DropReason::older_than_buffer, "older_than_buffer",
     "odometry at this stamp is forgotten; raise odom_buffer_length"},
    {DropReason::queue_full, "queue_full",
     "too many measurements wait for odometry; check that odom is published with the same clock"},
    {DropReason::shed, "shed",
     "steps take longer than measurements come, the older ones were left out; use fewer particles, "
     "a coarser map or update_min_d"},
    {DropReason::paused, "paused", "the node is paused; call ~pause with data: false"},
    {DropReason::numerical_error, "numerical_error", "the estimator could not use the measurement"},
};

const Entry& entry(DropReason reason) {
  for (const Entry& e : kEntries) {
    if (e.reason == reason) return e;
  }
  return kEntries[0];
}

}  // namespace

const char* drop_name(DropReason reason) { return entry(reason).name; }
const char* drop_text(DropReason reason) { return entry(reason).text; }

}  // namespace field_ros
