// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_phone/assembly/outbox.h"

#include <iterator>
#include <utility>

namespace vip_slam::phone {
namespace {

/// Behind what waits already; returns how many of the oldest had to go.
template <typename T>
std::size_t append(std::vector<T>* waiting, std::vector<T>&& more, std::size_t longest) {
  waiting->insert(waiting->end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
  if (waiting->size() <= longest) return 0;
  const std::size_t beyond = waiting->size() - longest;
  waiting->erase(waiting->begin(), waiting->begin() + static_cast<std::ptrdiff_t>(beyond));
  return beyond;
}

bool isEmpty(const Assembled& a) { return a.imu.empty() && a.color.empty() && a.depth.empty() && a.pose.empty(); }

}  // namespace

Outbox::Outbox(std::function<void(const Assembled&)> deliver)
    : deliver_(std::move(deliver)), thread_([this] { run(); }) {}

Outbox::~Outbox() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void Outbox::add(Assembled&& what) {
  if (isEmpty(what)) return;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    left_out_.samples += append(&waiting_.imu, std::move(what.imu), kMaxSamples);
    left_out_.samples += append(&waiting_.pose, std::move(what.pose), kMaxSamples);
    left_out_.images += append(&waiting_.color, std::move(what.color), kMaxImages);
    left_out_.images += append(&waiting_.depth, std::move(what.depth), kMaxImages);
  }
  changed_.notify_all();
}

OutboxCounts Outbox::leftOut() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return left_out_;
}

void Outbox::run() {
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return stop_ || !isEmpty(waiting_); });
    if (stop_) return;
    const Assembled now = std::exchange(waiting_, {});
    lock.unlock();
    deliver_(now);
    lock.lock();
  }
}

}  // namespace vip_slam::phone
