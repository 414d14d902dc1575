// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_phone/net/tcp_stream.h"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>
#include <cerrno>
#include <cstring>
#include <memory>

#include "vip_slam_core/util/formatted.h"
#include "vip_slam_phone/wire/bytes.h"

namespace vip_slam::phone {

std::string hostAndPort(const std::string& host, int port) {
  const bool v6 = host.find(':') != std::string::npos;
  return (v6 ? "[" + host + "]" : host) + ":" + std::to_string(port);
}

TcpStream::TcpStream(const std::string& host, int port, double timeout, const std::atomic<bool>& stop)
    : name_(hostAndPort(host, port)), timeout_(timeout), stop_(stop) {
  addrinfo hints{}, *list = nullptr;
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  if (const int error = getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &list))
    throw ConnectionError(name_ + ": " + gai_strerror(error));
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> guard(list, freeaddrinfo);
  std::string why = "no address";
  for (const addrinfo* a = list; a; a = a->ai_next) {
    socket_ = socket(a->ai_family, a->ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, a->ai_protocol);
    if (socket_ < 0) continue;
    try {
      int error = connect(socket_, a->ai_addr, a->ai_addrlen) == 0 ? 0 : errno;
      if (error == EINPROGRESS) {
        await(POLLOUT);
        socklen_t size = sizeof(error);
        getsockopt(socket_, SOL_SOCKET, SO_ERROR, &error, &size);
      }
      if (error == 0) {
        const int on = 1;
        setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
        return;
      }
      why = std::strerror(error);
    } catch (const ConnectionError& e) {
      why = "no answer";
    }
    close(socket_);
    socket_ = -1;
  }
  throw ConnectionError(name_ + ": " + why);
}

TcpStream::~TcpStream() {
  if (socket_ >= 0) close(socket_);
}

void TcpStream::await(short events) {
  for (double waited = 0; waited < timeout_; waited += 0.1) {
    if (stop_) throw ConnectionError(name_ + ": stopped");
    pollfd p{socket_, events, 0};
    const int ready = poll(&p, 1, 100);
    if (ready > 0) return;
    if (ready < 0 && errno != EINTR) throw ConnectionError(name_ + ": " + std::strerror(errno));
  }
  throw ConnectionError(name_ + formatted(": nothing for %.0f s", timeout_));
}

void TcpStream::read(void* data, std::size_t size) {
  for (auto at = static_cast<char*>(data); size > 0;) {
    const ssize_t got = recv(socket_, at, size, 0);
    if (got == 0) throw ConnectionError(name_ + ": closed by the phone");
    if (got > 0) {
      at += got;
      size -= static_cast<std::size_t>(got);
    } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
      await(POLLIN);
    } else if (errno != EINTR) {
      throw ConnectionError(name_ + ": " + std::strerror(errno));
    }
    if (stop_) throw ConnectionError(name_ + ": stopped");
  }
}

std::vector<std::uint8_t> TcpStream::read(std::size_t size) {
  std::vector<std::uint8_t> out(size);
  read(out.data(), size);
  return out;
}

std::vector<std::uint8_t> TcpStream::readMessage(std::size_t shortest, std::size_t longest, const std::string& what) {
  const auto size = Bytes(read(4)).little<std::uint32_t>(0);
  if (size < shortest || size > longest)
    throw WireError(name_ + ": " + what + " of " + std::to_string(size) + " bytes, expected " +
                    std::to_string(shortest) + " to " + std::to_string(longest) + ": is this port the app's?");
  return read(size);
}

void TcpStream::write(const void* data, std::size_t size) {
  for (auto at = static_cast<const char*>(data); size > 0;) {
    const ssize_t sent = send(socket_, at, size, MSG_NOSIGNAL);
    if (sent > 0) {
      at += sent;
      size -= static_cast<std::size_t>(sent);
    } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
      await(POLLOUT);
    } else if (errno != EINTR) {
      throw ConnectionError(name_ + ": " + std::strerror(errno));
    }
  }
}

}  // namespace vip_slam::phone
