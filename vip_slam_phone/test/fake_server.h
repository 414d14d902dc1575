// SPDX-License-Identifier: BSD-3-Clause
// A server on the loopback interface that says what it is told, whatever it is asked.
#pragma once

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>
#include <atomic>
#include <functional>
#include <stdexcept>
#include <thread>

#include "server.h"
#include "wire_bytes.h"

namespace vip_slam::phone {

class FakeServer {
 public:
  /// `say` gives what connection 0, 1, ... is sent before it is closed.
  explicit FakeServer(std::function<Raw(int)> say) : say_(std::move(say)) {
    listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(address);
    if (bind(listener_, reinterpret_cast<sockaddr*>(&address), size) < 0 || listen(listener_, 16) < 0 ||
        getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) < 0)
      throw std::runtime_error("the test's server does not start");
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { serve(); });
  }
  ~FakeServer() {
    stop_ = true;
    thread_.join();
    close(listener_);
  }
  int port() const { return port_; }
  int connections() const { return connections_; }

 private:
  void serve() {
    while (!stop_) {
      pollfd p{listener_, POLLIN, 0};
      if (poll(&p, 1, 20) <= 0) continue;
      const int client = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
      if (client < 0) continue;
      const Raw bytes = say_(connections_++);
      sendAll(client, bytes.data(), bytes.size());
      // What is asked is read to its end: with something unread, closing would take back what was sent.
      shutdown(client, SHUT_WR);
      char asked[4096];
      for (p.fd = client; !stop_ && (poll(&p, 1, 20) <= 0 || recv(client, asked, sizeof(asked), 0) > 0);) {
      }
      close(client);
    }
  }
  std::function<Raw(int)> say_;
  int listener_ = -1, port_ = 0;
  std::atomic<int> connections_{0};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace vip_slam::phone
