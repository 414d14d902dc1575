// SPDX-License-Identifier: BSD-3-Clause
// Little-endian bytes in and out, for files. The reader never reads beyond its end and never trusts a count.
#pragma once

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <type_traits>

#include <Eigen/Core>

namespace vip_slam {

class ByteWriter {
 public:
  template <class T>
  void put(T value) {
    static_assert(std::is_arithmetic<T>::value, "numbers only");
    char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    data_.append(bytes, sizeof(T));
  }
  void bytes(const void* p, std::size_t n) { data_.append(static_cast<const char*>(p), n); }
  template <class Vector>
  void vector(const Vector& v) {
    for (Eigen::Index k = 0; k < v.size(); ++k) put(v(k));
  }
  std::string take() { return std::move(data_); }
  const std::string& data() const { return data_; }

 private:
  std::string data_;
};

class ByteReader {
 public:
  /// `source` names the data in errors.
  ByteReader(const std::uint8_t* data, std::size_t size, std::string source)
      : begin_(data), at_(data), end_(data + size), source_(std::move(source)) {}

  [[noreturn]] void fail(const std::string& what) const {
    throw std::runtime_error(source_ + ": at byte " + std::to_string(at_ - begin_) + ": " + what);
  }
  std::size_t left() const { return static_cast<std::size_t>(end_ - at_); }

  template <class T>
  T get(const char* what) {
    static_assert(std::is_arithmetic<T>::value, "numbers only");
    if (left() < sizeof(T)) fail(std::string("ends before ") + what);
    T value;
    std::memcpy(&value, at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }
  void bytes(void* p, std::size_t n, const char* what) {
    if (left() < n) fail(std::string("ends before ") + what);
    std::memcpy(p, at_, n);
    at_ += n;
  }
  /// A count of elements, refused when the rest of the data cannot hold a byte of each. They are to be stored one by
  /// one as they are read, so that a wrong count takes no memory.
  std::size_t count(const char* what) {
    const auto n = get<std::uint32_t>(what);
    if (n > left())
      fail(std::to_string(n) + " " + what + " do not fit into the " + std::to_string(left()) + " bytes left");
    return n;
  }
  template <class Vector>
  Vector vector(const char* what) {
    Vector v;
    for (Eigen::Index k = 0; k < v.size(); ++k) v(k) = get<typename Vector::Scalar>(what);
    return v;
  }

 private:
  const std::uint8_t* begin_;
  const std::uint8_t* at_;
  const std::uint8_t* end_;
  std::string source_;
};

}  // namespace vip_slam
