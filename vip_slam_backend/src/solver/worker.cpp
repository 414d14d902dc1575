// SPDX-License-Identifier: BSD-3-Clause
#include "worker.h"

#include <algorithm>

#if defined(__linux__)
#include <sched.h>
#endif

namespace vip_slam {
namespace {

// Number of times the helper polls before it sleeps, about twenty microseconds: during a solve jobs follow each other
// within microseconds, and waking up is more expensive.
constexpr int kLooks = 1000;

// The helper is evaluated after every kStretch seconds of shared jobs, or as soon as it has cost kMaxLost seconds. It
// must save the share kMinGain, since split work is a little more than the same in one piece; else the owner does
// kJobsAlone jobs alone, about ten iterations of a solve.
constexpr double kStretch = 2e-3, kMaxLost = 0.5e-3, kMinGain = 0.1;
constexpr int kJobsAlone = 40;

inline void pause() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#endif
}

double seconds(std::chrono::steady_clock::duration d) { return std::chrono::duration<double>(d).count(); }

// Whether this process may run on one processor only; std::thread::hardware_concurrency() counts those of the machine.
bool oneProcessor() {
#if defined(__linux__)
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof(set), &set) == 0) return CPU_COUNT(&set) == 1;
#endif
  return std::thread::hardware_concurrency() == 1;
}

std::uint64_t pack(std::uint64_t front, std::uint64_t back) { return front << 16 | back; }
int frontOf(std::uint64_t left) { return static_cast<int>(left >> 16 & 0xffff); }
int backOf(std::uint64_t left) { return static_cast<int>(left & 0xffff); }

}  // namespace

Worker::Worker(bool helper) {
  if (helper && !oneProcessor()) thread_ = std::thread([this] { loop(); });
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

void Worker::share(int pieces, const std::function<void(int)>& job) {
  if (!helps() || pieces < 2) {
    if (alone_ > 0) --alone_;
    for (int k = 0; k < pieces; ++k) job(k);
    return;
  }
  const auto begin = Clock::now();
  job_ = &job;
  helped_ = 0;
  left_.store(pack(0, pieces));
  if (asleep_.load()) wake();
  for (int k = takeFront(); k >= 0; k = takeFront()) job(k);
  const auto done = Clock::now();
  for (int look = 0; left_.load(std::memory_order_acquire) & kBusy; ++look) {
    pause();
    if (look > kLooks) std::this_thread::yield();
  }
  judge(pieces, begin, done, Clock::now());
}

int Worker::takeFront() {
  std::uint64_t left = left_.load(std::memory_order_acquire);
  while (frontOf(left) < backOf(left)) {
    const std::uint64_t taken = (left & kBusy) | pack(frontOf(left) + 1, backOf(left));
    if (left_.compare_exchange_weak(left, taken)) return frontOf(left);
  }
  return -1;
}

void Worker::wake() {
  const std::lock_guard<std::mutex> lock(mutex_);
  wake_.notify_one();
}

// The gain is the time that the owner would have needed for the helper's pieces, not the time that the helper took.
void Worker::judge(int pieces, Clock::time_point begin, Clock::time_point done, Clock::time_point end) {
  const int own = std::max(1, pieces - helped_);
  gain_ += helped_ * seconds(done - begin) / own - seconds(end - done);
  spent_ += seconds(end - begin);
  if (spent_ < kStretch && gain_ > -kMaxLost) return;
  if (gain_ < kMinGain * spent_) alone_ = kJobsAlone;
  gain_ = spent_ = 0;
}

// The helper's loop: takes pieces from the back while there are any; false when there was none.
bool Worker::work() {
  std::uint64_t left = left_.load(std::memory_order_acquire);
  bool any = false;
  while (frontOf(left) < backOf(left)) {
    const int piece = backOf(left) - 1;
    if (!left_.compare_exchange_weak(left, kBusy | pack(frontOf(left), piece))) continue;
    (*job_)(piece);
    ++helped_;
    left = left_.fetch_and(~kBusy) & ~kBusy;
    any = true;
  }
  return any;
}

void Worker::loop() {
  const auto open = [this] {
    const std::uint64_t left = left_.load();
    return frontOf(left) < backOf(left);
  };
  for (;;) {
    for (int look = 0; look < kLooks; ++look) {
      if (work()) look = 0;
      if (stop_.load(std::memory_order_relaxed)) return;
      pause();
    }
    std::unique_lock<std::mutex> lock(mutex_);
    asleep_ = true;
    wake_.wait(lock, [&] { return stop_ || open(); });
    asleep_ = false;
    if (stop_) return;
  }
}

}  // namespace vip_slam
