// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/owner_thread.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <memory>

#include "vip_slam_ros/thread_priority.h"

namespace vip_slam {

OwnerThread::OwnerThread(ErrorHandler on_error) : on_error_(std::move(on_error)) {}

OwnerThread::~OwnerThread() { stop(); }

OwnerThread::Lane OwnerThread::addLane(const std::string& name, std::size_t capacity) {
  lanes_.push_back({name, 0, std::max<std::size_t>(1, capacity), 0});
  return lanes_.size() - 1;
}

void OwnerThread::start(int niceness) {
  thread_ = std::thread([this, niceness] {
    lowerThreadPriority(niceness);
    loop();
  });
}

void OwnerThread::stop() {
  std::deque<Task> forgotten;  // destroyed outside the lock, since destructors of captures may call this object
  {
    std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
    tasks_.swap(forgotten);
    for (LaneState& lane : lanes_) lane.waiting = 0;
    ready_.notify_all();
  }
  forgotten.clear();
  if (thread_.joinable()) thread_.join();
}

bool OwnerThread::post(Lane lane, std::function<void()> task) {
  Task oldest;  // likewise
  std::lock_guard<std::mutex> lock(mutex_);
  if (stopping_) return false;
  LaneState& state = lanes_.at(lane);
  const bool full = state.waiting >= state.capacity;
  if (full) {
    const auto it = std::find_if(tasks_.begin(), tasks_.end(), [lane](const Task& t) { return t.lane == lane; });
    oldest = std::move(*it);
    tasks_.erase(it);
    ++state.dropped;
  } else {
    ++state.waiting;
  }
  tasks_.push_back({lane, std::move(task)});
  ready_.notify_one();
  return !full;
}

bool OwnerThread::call(Lane lane, std::function<void()> task, double seconds) {
  // 0: waiting, 1: started, 2: given up; the first thread to change it from 0 decides.
  auto phase = std::make_shared<std::atomic<int>>(0);
  // Only the task holds its promise: when it is discarded (a full lane, a stopping thread) the wait ends at once.
  auto done = std::make_shared<std::promise<void>>();
  std::future<void> finished = done->get_future();
  post(lane, [phase, done = std::move(done), task = std::move(task)] {
    int expected = 0;
    if (!phase->compare_exchange_strong(expected, 1)) return;
    try {
      task();
      done->set_value();
    } catch (...) {
      done->set_exception(std::current_exception());
    }
  });
  if (finished.wait_for(std::chrono::duration<double>(seconds)) != std::future_status::ready) {
    int expected = 0;
    if (phase->compare_exchange_strong(expected, 2)) return false;
  }
  try {
    finished.get();
  } catch (const std::future_error& error) {
    if (error.code() == std::future_errc::broken_promise) return false;
    throw;
  }
  return true;
}

std::vector<OwnerThread::LaneState> OwnerThread::lanes() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return lanes_;
}

void OwnerThread::loop() {
  for (;;) {
    Task task;
    {
      std::unique_lock<std::mutex> lock(mutex_);
      ready_.wait(lock, [this] { return stopping_ || !tasks_.empty(); });
      if (stopping_) return;
      task = std::move(tasks_.front());
      tasks_.pop_front();
      --lanes_[task.lane].waiting;
    }
    try {
      task.run();
    } catch (const std::exception& error) {
      on_error_(lanes_[task.lane].name + ": " + error.what());
    }
  }
}

}  // namespace vip_slam
