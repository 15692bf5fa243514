// The live node: everything but the estimator's name is field_ros.
#include "field_ros/node.hpp"
#include "gp_localize/gp_localize.hpp"

int main(int argc, char** argv) { return field_ros::run_node<gp_localize::GpLocalize>(argc, argv); }
