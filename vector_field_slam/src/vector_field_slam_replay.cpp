// The same estimator over a bag, without roscore: everything but its name is field_ros.
#include "field_ros/replay.hpp"
#include "vector_field_slam/vector_field_slam.hpp"

namespace {

/// Waits for the background optimization where the live node would go on without it.
struct Waiting : vector_field_slam::VectorFieldSlam {
  Waiting(const Params& params, std::uint64_t seed) : VectorFieldSlam(params, seed) {
    wait_for_background();
  }
};

}  // namespace

int main(int argc, char** argv) { return field_ros::run_replay<Waiting>(argc, argv); }
