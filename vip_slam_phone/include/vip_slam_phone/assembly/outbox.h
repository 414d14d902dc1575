// SPDX-License-Identifier: BSD-3-Clause
// Hands on what was received in a thread of its own, so that whoever takes it slowly does not stall the reading.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include "vip_slam_phone/assembly/assembler.h"

namespace vip_slam::phone {

/// What was left out because it was not taken in time.
struct OutboxCounts {
  std::size_t images = 0;   ///< colour and depth
  std::size_t samples = 0;  ///< IMU and poses
};

class Outbox {
 public:
  /// `deliver` is called from the outbox's thread with all that has come since the last call, of each kind in order.
  explicit Outbox(std::function<void(const Assembled&)> deliver);
  /// Waits for the call that is under way; what is left is not delivered.
  ~Outbox();

  /// Returns at once. Beyond the bounds the oldest are left out and counted.
  void add(Assembled&& what);
  OutboxCounts leftOut() const;

  static constexpr std::size_t kMaxImages = 8;      ///< of each kind; a quarter of a second
  static constexpr std::size_t kMaxSamples = 1000;  ///< of each kind; ten seconds of the IMU

 private:
  void run();
  const std::function<void(const Assembled&)> deliver_;
  mutable std::mutex mutex_;  ///< guards what follows
  std::condition_variable changed_;
  Assembled waiting_;
  OutboxCounts left_out_;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace vip_slam::phone
