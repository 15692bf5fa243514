// The live node: everything but the estimator's name is field_ros.
#include "field_ros/node.hpp"
#include "gmrf_slap/gmrf_slap.hpp"

int main(int argc, char** argv) { return field_ros::run_node<gmrf_slap::GmrfSlap>(argc, argv); }
