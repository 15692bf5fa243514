// The same estimator over a bag, without roscore: everything but its name is field_ros.
#include "field_ros/replay.hpp"
#include "gmrf_slap/gmrf_slap.hpp"

int main(int argc, char** argv) { return field_ros::run_replay<gmrf_slap::GmrfSlap>(argc, argv); }
