#include "field_ros/state_keeper.hpp"

#include <ros/console.h>

#include <filesystem>
#include <utility>

#include "field_core/errors.hpp"
#include "field_ros/state_file.hpp"

namespace field_ros {

StateKeeper::StateKeeper(Session& session) : session_(session), last_(Clock::now()) {
  const NodeParams& params = session.params();
  if (params.resume &&
      std::filesystem::exists(state_path(params.state_directory, params.save_name))) {
    load(params.save_name);
    return;
  }
  if (!params.load_state.empty()) load(params.load_state);
  for (int robot = 0; params.start_anywhere && robot < session.robots(); ++robot) {
    session_.scatter(robot);
  }
}

StateKeeper::~StateKeeper() { collect(true); }

void StateKeeper::load(const std::string& name) {
  const std::string path = state_path(session_.params().state_directory, name);
  try {
    session_.restore(read_state_file(path));
  } catch (const field_core::DataError& e) {
    const std::string text = e.what();
    throw field_core::DataError(text.rfind(path, 0) == 0 ? text : path + ": " + text);
  }
  ROS_INFO("starts with the state %s", path.c_str());
}

void StateKeeper::collect(bool wait) {
  if (!writing_.valid()) return;
  if (!wait && writing_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
  const std::string before = std::exchange(problem_, writing_.get());
  if (problem_.empty()) {
    ++saved_;
    return;
  }
  applied_at_save_ = 0;  // tried again at the next period
  if (problem_ != before) ROS_WARN("the state is not saved: %s", problem_.c_str());
}

void StateKeeper::save_in_background() {
  applied_at_save_ = session_.applied();
  const auto write = [](const std::string& directory, const std::string& name,
                        const field_msgs::EstimatorState& state) -> std::string {
    try {
      const std::string path = state_path(directory, name);
      create_directories(path.substr(0, path.rfind('/')));
      write_state_file(path, state);
      return "";
    } catch (const std::exception& e) {
      return e.what();
    }
  };
  const NodeParams& params = session_.params();
  writing_ = std::async(std::launch::async, write, params.state_directory, params.save_name,
                        session_.save_state());
}

void StateKeeper::tick(Clock::time_point now) {
  collect(false);
  const double period = session_.params().save_period;
  if (period <= 0.0 || writing_.valid() || !learned()) return;
  if (now - last_ < std::chrono::duration<double>(period)) return;
  last_ = now;
  save_in_background();
}

void StateKeeper::finish() {
  collect(true);
  if (session_.params().save_period <= 0.0 || !learned()) return;
  save_in_background();
  collect(true);
}

}  // namespace field_ros
