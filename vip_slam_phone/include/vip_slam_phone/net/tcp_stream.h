// SPDX-License-Identifier: BSD-3-Clause
// A TCP connection that gives up in time and can be told to stop from another thread.
#pragma once

#include <atomic>
#include <stdexcept>
#include <string>
#include <vector>

namespace vip_slam::phone {

/// Cannot connect, was closed, or nothing came in time; the message names address and cause.
struct ConnectionError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// As in an URL: an address of IPv6 has brackets around it.
std::string hostAndPort(const std::string& host, int port);

class TcpStream {
 public:
  /// Connects within `timeout` seconds, which is also how long a read or write waits. `stop` outlives the stream; once
  /// it is set, all that waits ends with ConnectionError within a tenth of a second.
  TcpStream(const std::string& host, int port, double timeout, const std::atomic<bool>& stop);
  ~TcpStream();
  TcpStream(const TcpStream&) = delete;
  TcpStream& operator=(const TcpStream&) = delete;

  /// Exactly `size` bytes.
  void read(void* data, std::size_t size);
  std::vector<std::uint8_t> read(std::size_t size);
  /// What follows a little-endian length of 4 bytes. Throws WireError, before anything of it is read, when that is not
  /// from `shortest` to `longest`; `what` names it.
  std::vector<std::uint8_t> readMessage(std::size_t shortest, std::size_t longest, const std::string& what);
  void write(const void* data, std::size_t size);

 private:
  void await(short events);
  std::string name_;
  double timeout_;
  const std::atomic<bool>& stop_;
  int socket_ = -1;
};

}  // namespace vip_slam::phone
