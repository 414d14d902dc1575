// SPDX-License-Identifier: BSD-3-Clause
// The phone's three ports on the loopback interface, one client each.
#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace vip_slam::phone {

/// A port with at most one client that takes what is sent; another that connects takes its place.
class Port {
 public:
  /// Listens on 127.0.0.1. `greet` speaks with a new client on its socket until true: it gets what is sent from now
  /// on. `listen_on`, if given, runs afterwards as long as the client is there. Throws std::runtime_error when the port
  /// is taken.
  Port(int port, std::function<bool(int)> greet, std::function<void(int)> listen_on = {});
  ~Port();
  /// To the client, if there is one; in pieces of at most `piece` bytes (0: at once).
  void send(const std::vector<std::uint8_t>& bytes, std::size_t piece = 0);
  /// Whether a client has come since the last call.
  bool fresh() { return fresh_.exchange(false); }
  void disconnect();

 private:
  void accept();
  void drop();  ///< the client; under the mutex
  std::function<bool(int)> greet_;
  std::function<void(int)> listen_on_;
  int listener_ = -1;
  std::mutex mutex_;
  int client_ = -1;
  std::atomic<bool> fresh_{false}, stop_{false};
  std::vector<std::thread> talks_;
  std::thread thread_;
};

/// All of it, or false.
bool sendAll(int socket, const void* data, std::size_t size);

}  // namespace vip_slam::phone
