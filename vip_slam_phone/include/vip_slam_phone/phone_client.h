// SPDX-License-Identifier: BSD-3-Clause
// A phone's three streams, received in threads of their own, reconnected when they break, assembled on one clock.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "vip_slam_phone/assembly/assembler.h"
#include "vip_slam_phone/assembly/outbox.h"
#include "vip_slam_phone/video/rtsp_text.h"
#include "vip_slam_phone/wire/handshake.h"

namespace vip_slam::phone {

struct PhoneOptions {
  std::string host;
  int rtsp_port = 8554, record_port = 8555, depth_port = 8556;
  std::string path = "/live";
  Credentials credentials;  ///< empty user: none
  int width = 640;          ///< of the images that come out, pixels
  double timeout = 3;       ///< s without anything until a stream is connected anew
};

struct StreamStatus {
  bool connected = false;
  std::size_t connections = 0;  ///< since the start
  std::size_t received = 0;     ///< records, images
  std::size_t lost = 0;         ///< packets, depth images
  std::string problem;          ///< in words; empty when all is well
};

struct PhoneStatus {
  StreamStatus records, video, depth;
  AssemblyCounts assembly;
  OutboxCounts left_out;
  std::size_t imu = 0, color = 0, depth_images = 0;  ///< assembled
  std::size_t untimed = 0;                           ///< images left out: before the first sender report
  bool sender_report = false, clock_ready = false;
  double clock_offset = 0, clock_slew = 0;  ///< s, s/s
  double breathing = 1;
  std::vector<std::string> complaints;  ///< what the app's settings spoil
};

class PhoneClient {
 public:
  /// `now` is our clock in s. `deliver` is called from a thread of its own: what it does not take in time is left out
  /// and counted, and the streams are read all the same.
  PhoneClient(const PhoneOptions& options, std::function<double()> now, std::function<void(const Assembled&)> deliver);
  ~PhoneClient();

  PhoneStatus status() const;

 private:
  void keep(StreamStatus PhoneStatus::*stream, const std::function<void()>& receive);
  void receiveRecords();
  void receiveVideo();
  void receiveDepth();
  Handshake readHandshake(class TcpStream* stream, const std::string& protocol);
  void handOn(Assembled&& out);  ///< under the mutex

  const PhoneOptions options_;
  const std::function<double()> now_;
  std::atomic<bool> stop_{false};
  mutable std::mutex mutex_;  ///< guards what follows
  Assembler assembler_;
  PhoneStatus status_;
  double host_minus_unix_ = 0;  ///< of the session: another value is another session
  Outbox outbox_;
  std::vector<std::thread> threads_;
};

}  // namespace vip_slam::phone
