// SPDX-License-Identifier: BSD-3-Clause
// The thread that owns an estimator: all tasks that use the estimator run here, in the order of their posting.
// Tasks are queued in lanes of bounded length; a full lane drops its oldest task and counts it.
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
  /// Called with the lane and what() of a std::exception thrown by a task. Any other exception of a task ends the
  /// process.
  using ErrorHandler = std::function<void(const std::string&)>;

  explicit OwnerThread(ErrorHandler on_error);
  /// Finishes the running task, discards the rest.
  ~OwnerThread();
  OwnerThread(const OwnerThread&) = delete;
  OwnerThread& operator=(const OwnerThread&) = delete;

  /// Before start().
  Lane addLane(const std::string& name, std::size_t capacity);
  /// `niceness`: added to the thread's nice value, see thread_priority.h.
  void start(int niceness = 0);
  /// Finishes the running task, discards the rest; waiting call()s of discarded tasks return false.
  void stop();

  /// False when the lane was full and its oldest task was dropped, or when the thread has stopped.
  bool post(Lane lane, std::function<void()> task);
  /// Runs `task` on the thread, waits for it and rethrows its exception. False when it did not start within `seconds`,
  /// was dropped from a full lane, or the thread has stopped; then it never runs.
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
