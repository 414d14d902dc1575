// The thread that owns an estimator: everything that touches the estimator runs here, in the order it was handed over.
// Work comes in lanes of bounded length; a full lane loses its oldest work, and the loss is counted.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <future>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace vip_slam {

class OwnerThread {
 public:
  using Lane = std::size_t;
  /// Called with the words of an exception that a task let out.
  using ErrorHandler = std::function<void(const std::string&)>;

  explicit OwnerThread(ErrorHandler on_error);
  /// Finishes the task at hand, forgets the rest.
  ~OwnerThread();
  OwnerThread(const OwnerThread&) = delete;
  OwnerThread& operator=(const OwnerThread&) = delete;

  /// Before start().
  Lane addLane(const std::string& name, std::size_t capacity);
  /// `niceness`: how far the thread gives way, see thread_priority.h.
  void start(int niceness = 0);
  void stop();

  /// False when the lane was full and its oldest task went, or when the thread has stopped.
  bool post(Lane lane, std::function<void()> task);
  /// Runs `task` on the thread and waits for it. False when it did not begin within `seconds` (it then never will).
  bool call(Lane lane, std::function<void()> task, double seconds);

  struct LaneState {
    std::string name;
    std::size_t waiting, capacity, dropped;
  };
  std::vector<LaneState> lanes() const;

 private:
  struct Task {
    Lane lane;
    std::function<void()> run;
  };
  void loop();

  ErrorHandler on_error_;
  mutable std::mutex mutex_;
  std::condition_variable ready_;
  std::deque<Task> tasks_;
  std::vector<LaneState> lanes_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace vip_slam
