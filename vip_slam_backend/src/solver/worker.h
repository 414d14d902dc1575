// One helper thread that lives as long as a solve and takes one of two jobs at a time.
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace vip_slam {

class Worker {
 public:
  /// Without a helper, both jobs run here, one after the other.
  explicit Worker(bool helper);
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  bool helps() const { return thread_.joinable(); }
  /// Runs both and returns when both are done. The jobs must not throw and must not write to the same places.
  void both(const std::function<void()>& here, const std::function<void()>& there);

 private:
  void loop();

  std::mutex mutex_;
  std::condition_variable wake_;
  std::atomic<const std::function<void()>*> job_{nullptr};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace vip_slam
