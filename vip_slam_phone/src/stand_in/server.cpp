// SPDX-License-Identifier: BSD-3-Clause
#include "server.h"

#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>
#include <algorithm>
#include <stdexcept>

namespace vip_slam::phone {

bool sendAll(int socket, const void* data, std::size_t size) {
  for (auto at = static_cast<const char*>(data); size > 0;) {
    const ssize_t sent = ::send(socket, at, size, MSG_NOSIGNAL);
    if (sent <= 0) return false;
    at += sent;
    size -= static_cast<std::size_t>(sent);
  }
  return true;
}

Port::Port(int port, std::function<bool(int)> greet, std::function<void(int)> listen_on)
    : greet_(std::move(greet)), listen_on_(std::move(listen_on)) {
  listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int on = 1;
  setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (bind(listener_, reinterpret_cast<sockaddr*>(&address), sizeof(address)) < 0 || listen(listener_, 4) < 0) {
    close(listener_);
    throw std::runtime_error("127.0.0.1:" + std::to_string(port) + " is taken");
  }
  thread_ = std::thread([this] { accept(); });
}

Port::~Port() {
  stop_ = true;
  thread_.join();
  disconnect();
  for (std::thread& talk : talks_) talk.join();
  close(listener_);
}

void Port::accept() {
  while (!stop_) {
    pollfd p{listener_, POLLIN, 0};
    if (poll(&p, 1, 100) <= 0) continue;
    const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (client < 0) continue;
    const int on = 1;
    setsockopt(client, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
    const timeval wait{5, 0};
    setsockopt(client, SOL_SOCKET, SO_SNDTIMEO, &wait, sizeof(wait));
    setsockopt(client, SOL_SOCKET, SO_RCVTIMEO, &wait, sizeof(wait));
    disconnect();
    if (!greet_(client)) {
      close(client);
      continue;
    }
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      client_ = client;
      fresh_ = true;
    }
    if (!listen_on_) continue;
    talks_.emplace_back([this, client] {
      listen_on_(client);
      const std::lock_guard<std::mutex> lock(mutex_);
      if (client_ == client) client_ = -1;
      close(client);
    });
  }
}

void Port::send(const std::vector<std::uint8_t>& bytes, std::size_t piece) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (piece == 0) piece = bytes.size();
  for (std::size_t at = 0; client_ >= 0 && at < bytes.size(); at += piece)
    if (!sendAll(client_, bytes.data() + at, std::min(piece, bytes.size() - at))) drop();
}

void Port::disconnect() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (client_ >= 0) drop();
}

void Port::drop() {
  shutdown(client_, SHUT_RDWR);
  if (!listen_on_) close(client_);  // else whoever listens on it does
  client_ = -1;
}

}  // namespace vip_slam::phone
