// The live node: everything but the estimator's name is field_ros.
#include "field_ros/node.hpp"
#include "vector_field_slam/vector_field_slam.hpp"

int main(int argc, char** argv) {
  return field_ros::run_node<vector_field_slam::VectorFieldSlam>(argc, argv);
}
