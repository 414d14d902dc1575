#include "worker.h"

namespace vip_slam {
namespace {

// Jobs follow each other within microseconds during a solve: looking again is cheaper than sleeping, for this many
// times. Afterwards the processor belongs to others.
constexpr int kLooks = 2000;

}  // namespace

Worker::Worker(bool helper) {
  if (helper) thread_ = std::thread([this] { loop(); });
}

Worker::~Worker() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void Worker::both(const std::function<void()>& here, const std::function<void()>& there) {
  if (!helps()) {
    there();
    here();
    return;
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    job_.store(&there, std::memory_order_release);
  }
  wake_.notify_one();
  here();
  for (int look = 0; job_.load(std::memory_order_acquire) != nullptr; ++look)
    if (look > kLooks) std::this_thread::yield();
}

void Worker::loop() {
  for (;;) {
    for (int look = 0; look < kLooks && !job_.load(std::memory_order_acquire) && !stop_; ++look) {
    }
    if (!job_.load(std::memory_order_acquire)) {
      std::unique_lock<std::mutex> lock(mutex_);
      wake_.wait(lock, [this] { return stop_ || job_.load(std::memory_order_acquire) != nullptr; });
      if (job_.load(std::memory_order_acquire) == nullptr) return;
    }
    (*job_.load(std::memory_order_acquire))();
    job_.store(nullptr, std::memory_order_release);
  }
}

}  // namespace vip_slam
