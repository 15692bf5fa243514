#include "field_bags/world.hpp"
#include "field_ros/param_loader.hpp"

namespace field_bags {

WorldParams load_world(const std::string& path) {
  WorldParams params;
  field_ros::load_params(field_ros::ParamTree::from_yaml_file(path), params);
  return params;
}

}  // namespace field_bags
