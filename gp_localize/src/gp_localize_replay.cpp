// The same estimator over a bag, without roscore: everything but its name is field_ros.
#include "field_ros/replay.hpp"
#include "gp_localize/gp_localize.hpp"

int main(int argc, char** argv) {
  return field_ros::run_replay<gp_localize::GpLocalize>(argc, argv);
}
