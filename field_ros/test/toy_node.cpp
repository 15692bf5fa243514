// The toy estimator as a node, for rostests.
#include "field_ros/node.hpp"
#include "toy_estimator.hpp"

int main(int argc, char** argv) {
  return field_ros::run_node<field_ros_test::ToyEstimator>(argc, argv);
}
