// Changing RuntimeParams while the node runs: the protocol of dynamic_reconfigure (rqt_reconfigure,
// dynparam), made from the struct's own declaration instead of a .cfg file that would repeat it.
#pragma once

#include <dynamic_reconfigure/Config.h>
#include <dynamic_reconfigure/ConfigDescription.h>
#include <dynamic_reconfigure/Reconfigure.h>
#include <ros/node_handle.h>

#include <functional>
#include <string>

#include "field_ros/runtime_params.hpp"

namespace field_ros {

/// Names, types, ranges and texts. A range without an end has +-1e9 there: rqt draws no infinity.
dynamic_reconfigure::ConfigDescription describe(const RuntimeParams& params);
dynamic_reconfigure::Config to_config(const RuntimeParams& params);
/// `params` with the values of `request`. @throws ParameterError for a name that is unknown, of
/// another type, or a value that is out of range
RuntimeParams changed(RuntimeParams params, const dynamic_reconfigure::Config& request);

/// ~set_parameters, ~parameter_descriptions, ~parameter_updates.
class Reconfigure {
 public:
  /// @param apply called with the new values
  Reconfigure(ros::NodeHandle& private_handle, const RuntimeParams& params,
              std::function<void(const RuntimeParams&)> apply);

 private:
  bool on_request(dynamic_reconfigure::Reconfigure::Request& request,
                  dynamic_reconfigure::Reconfigure::Response& response);

  RuntimeParams params_;
  std::function<void(const RuntimeParams&)> apply_;
  ros::Publisher descriptions_, updates_;
  ros::ServiceServer server_;
};

}  // namespace field_ros
