// The same estimator over a bag, without roscore: everything but its name is field_ros.
#include "field_ros/replay.hpp"
#include "vector_field_slam/vector_field_slam.hpp"

int main(int argc, char** argv) {
  return field_ros::run_replay<vector_field_slam::VectorFieldSlam>(argc, argv);
}
