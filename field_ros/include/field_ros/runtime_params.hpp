// Parameters of a node that may change while it runs, by dynamic_reconfigure (~set_parameters).
#pragma once

#include "field_core/errors.hpp"
#include "field_core/params.hpp"

namespace field_ros {

/// Numbers and flags only: nothing here changes what the estimator is.
struct RuntimeParams {
  bool tf_broadcast = true;
  double transform_tolerance = 0.1;
  double map_publish_period = 2.0;
  int path_length = 10000;
  double save_period = 0.0;
  double max_pose_lag = 1.0;
  double input_timeout = 5.0;
  double lost_nis = 6.0;
  bool recovery = false;

  template <class Visitor>
  void visit(Visitor& v) {
    using field_core::non_negative;
    using field_core::positive;
    v.flag("tf_broadcast", tf_broadcast, "publish the transform map -> odom");
    v.number("transform_tolerance", transform_tolerance, non_negative(), "s",
             "map -> odom is dated this far into the future");
    v.number("map_publish_period", map_publish_period, non_negative(), "s",
             "time between published field maps; 0: never");
    v.number("path_length", path_length, {1, 1000000}, "1", "latest poses kept in ~path");
    v.number("save_period", save_period, non_negative(), "s",
             "time between automatic savings of the state; 0: only ~save_state saves");
    v.number("max_pose_lag", max_pose_lag, non_negative(), "s",
             "a measurement is shed if one this much newer is ready as well (the machine is too "
             "slow); 0: none is ever shed");
    v.number("input_timeout", input_timeout, positive(), "s",
             "without odometry or measurements for so long diagnostics say STALE (wall time)");
    v.number("lost_nis", lost_nis, {1.0, 1e6}, "1",
             "lost: NIS per degree of freedom of the last measurements (1 is ideal) above this; "
             "found again below half of it");
    v.flag("recovery", recovery, "when lost, look for the robot everywhere (global_localization)");
  }
};

}  // namespace field_ros
