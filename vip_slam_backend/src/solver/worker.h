// One helper thread that takes pieces of what its owner has to do and sleeps between its jobs.
//
// Nothing is owed to the helper: a piece that it has not begun when the owner is through with the others is the
// owner's, so that a helper which is slow to wake or gets no processor costs little. Where it costs more than it helps,
// the owner goes on alone and tries again later.
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
  /// Without a helper, or where this process has one processor only, all pieces run here.
  explicit Worker(bool helper);
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// Whether pieces shared now are offered to a helper.
  bool helps() const { return thread_.joinable() && alone_ == 0; }
  /// Runs job(0), ..., job(pieces - 1), each once, and returns when all are done: here from the front, by the helper
  /// from the back. A job must not throw, and no two pieces may write to the same places.
  void share(int pieces, const std::function<void(int)>& job);

 private:
  using Clock = std::chrono::steady_clock;
  void loop();
  int takeFront();
  bool work();
  void wake();
  void judge(int pieces, Clock::time_point begin, Clock::time_point done, Clock::time_point end);

  // Pieces that are left, [front, back), and whether the helper is at one: one word, so that each is taken once.
  static constexpr std::uint64_t kBusy = std::uint64_t{1} << 63;
  alignas(64) std::atomic<std::uint64_t> left_{0};
  const std::function<void(int)>* job_ = nullptr;
  int helped_ = 0;  // pieces of the present job that the helper did

  alignas(64) std::atomic<bool> asleep_{false}, stop_{false};
  std::mutex mutex_;
  std::condition_variable wake_;
  std::thread thread_;

  double gain_ = 0, spent_ = 0;  // seconds: what the helper saved, of those in shared jobs
  int alone_ = 0;                // jobs that are not offered
};

}  // namespace vip_slam
