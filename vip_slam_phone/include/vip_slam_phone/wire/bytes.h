// SPDX-License-Identifier: BSD-3-Clause
// Bytes from the network. Every length is checked before it is believed.
#pragma once

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

namespace vip_slam::phone {

/// What the phone sent is not what the protocol says; the message names what was found and what was expected.
struct WireError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A view of bytes that somebody else owns. Reads beyond its end throw WireError.
class Bytes {
 public:
  Bytes() = default;
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  Bytes(const std::vector<std::uint8_t>& bytes) : data_(bytes.data()), size_(bytes.size()) {}

  const std::uint8_t* data() const { return data_; }
  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  std::uint8_t operator[](std::size_t at) const {
    need(at, 1);
    return data_[at];
  }
  /// From `at` to the end.
  Bytes from(std::size_t at) const {
    need(at, 0);
    return {data_ + at, size_ - at};
  }
  Bytes part(std::size_t at, std::size_t count) const {
    need(at, count);
    return {data_ + at, count};
  }

  /// Little-endian, as the records and the depth images are. T: unsigned, signed, float or double.
  template <typename T>
  T little(std::size_t at) const {
    need(at, sizeof(T));
    std::uint8_t raw[sizeof(T)];
    for (std::size_t i = 0; i < sizeof(T); ++i) raw[i] = data_[at + (kHostLittle ? i : sizeof(T) - 1 - i)];
    T value;
    std::memcpy(&value, raw, sizeof(T));
    return value;
  }
  /// Big-endian, as RTP and RTCP are. T: unsigned.
  template <typename T>
  T big(std::size_t at) const {
    need(at, sizeof(T));
    T value = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i) value = static_cast<T>(value << 8 | data_[at + i]);
    return value;
  }

 private:
  static constexpr bool kHostLittle = __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__;
  void need(std::size_t at, std::size_t count) const {
    if (at > size_ || count > size_ - at)
      throw WireError(std::to_string(size_) + " bytes, expected at least " + std::to_string(at + count));
  }
  const std::uint8_t* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace vip_slam::phone
