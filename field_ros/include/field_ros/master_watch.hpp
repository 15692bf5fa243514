// Whether the ROS master still knows this node.
#pragma once

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>

namespace field_ros {

/// A roscore that was restarted knows none of the nodes that run: nobody finds their topics and
/// services. Asks it now and then, in a thread of its own, since a master out of reach must not
/// hold up the steps.
class MasterWatch {
 public:
  explicit MasterWatch(double period_s);
  /// Waits for a question that is under way.
  ~MasterWatch();
  MasterWatch(const MasterWatch&) = delete;
  MasterWatch& operator=(const MasterWatch&) = delete;

  /// The master answers and has no node of our name.
  bool forgotten() const { return forgotten_; }
  /// All has been advertised again.
  void registered() { forgotten_ = false; }

 private:
  void watch(double period_s);

  std::atomic<bool> forgotten_{false};
  std::mutex mutex_;
  std::condition_variable wake_;
  bool end_ = false;
  std::thread thread_;
};

}  // namespace field_ros
