#include "field_ros/master_watch.hpp"

#include <ros/master.h>
#include <ros/this_node.h>

#include <chrono>
#include <string>

namespace field_ros {
namespace {

bool answers(const char* method, const XmlRpc::XmlRpcValue& request) {
  XmlRpc::XmlRpcValue response, payload;
  return ros::master::execute(method, request, response, payload, false);
}

// "lookupNode" fails for an unknown name as for a master that is not there: getPid tells the two
// apart.
bool master_has_forgotten_us() {
  XmlRpc::XmlRpcValue caller, lookup;
  caller[0] = ros::this_node::getName();
  lookup[0] = ros::this_node::getName();
  lookup[1] = ros::this_node::getName();
  return !answers("lookupNode", lookup) && answers("getPid", caller);
}

}  // namespace

MasterWatch::MasterWatch(double period_s) : thread_([this, period_s] { watch(period_s); }) {}

MasterWatch::~MasterWatch() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    end_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void MasterWatch::watch(double period_s) {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!wake_.wait_for(lock, std::chrono::duration<double>(period_s), [this] { return end_; })) {
    lock.unlock();
    // While the node is advertising again, this may come a moment late: it then does so twice.
    if (master_has_forgotten_us()) forgotten_ = true;
    lock.lock();
  }
}

}  // namespace field_ros
