// SPDX-License-Identifier: BSD-3-Clause
// One helper thread that takes pieces of its owner's work and sleeps between jobs.
//
// The owner never waits for the helper to start: pieces that it has not begun when the owner is done with the others
// are done by the owner, so that a helper which wakes slowly or gets no processor costs little. When it costs more than
// it saves, the owner works alone and tries again later.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>

namespace vip_slam {

class Worker {
 public:
  /// Without a helper, or with a single processor, all pieces run in the calling thread.
  explicit Worker(bool helper);
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// Whether pieces of the next share() call are offered to a helper.
  bool helps() const { return thread_.joinable() && alone_ == 0; }
  /// Runs job(0), ..., job(pieces - 1), each once, and returns when all are done: the caller from the front, the helper
  /// from the back. A job must not throw, and no two pieces may write to the same memory.
  void share(int pieces, const std::function<void(int)>& job);

 private:
  using Clock = std::chrono::steady_clock;
  void loop();
  int takeFront();
  bool work();
  void wake();
  void judge(int pieces, Clock::time_point begin, Clock::time_point done, Clock::time_point end);

  // Pieces left, [front, back), and whether the helper is running one: in one atomic word, so that each is taken once.
  static constexpr std::uint64_t kBusy = std::uint64_t{1} << 63;
  alignas(64) std::atomic<std::uint64_t> left_{0};
  const std::function<void(int)>* job_ = nullptr;
  int helped_ = 0;  // pieces of the present job that the helper did

  alignas(64) std::atomic<bool> asleep_{false}, stop_{false};
  std::mutex mutex_;
  std::condition_variable wake_;
  std::thread thread_;

  double gain_ = 0, spent_ = 0;  // seconds saved by the helper, and seconds spent in shared jobs
  int alone_ = 0;                // number of jobs left that are not offered to the helper
};

}  // namespace vip_slam
