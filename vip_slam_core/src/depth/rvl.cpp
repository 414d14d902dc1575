// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/depth/rvl.h"

#include <stdexcept>
#include <string>
#include <utility>

#include "vip_slam_core/util/size_text.h"

namespace vip_slam {
namespace {

constexpr int kNibblesInWord = 8;
constexpr std::uint32_t kDigit = 7, kMore = 8;

class Writer {
 public:
  void number(std::uint32_t value) {
    do {
      const std::uint32_t digit = value & kDigit;
      value >>= 3;
      nibble(digit | (value ? kMore : 0));
    } while (value);
  }
  std::vector<std::uint8_t> finish() {
    while (nibbles_ > 0) nibble(0);
    return std::move(bytes_);
  }

 private:
  void nibble(std::uint32_t value) {
    word_ = word_ << 4 | value;
    if (++nibbles_ < kNibblesInWord) return;
    for (int k = 0; k < 4; ++k) bytes_.push_back(static_cast<std::uint8_t>(word_ >> 8 * k));
    word_ = 0, nibbles_ = 0;
  }

  std::vector<std::uint8_t> bytes_;
  std::uint32_t word_ = 0;
  int nibbles_ = 0;
};

class Reader {
 public:
  Reader(const std::uint8_t* data, std::size_t bytes) : data_(data), bytes_(bytes) {}

  std::uint32_t number() {
    std::uint32_t value = 0;
    for (int shift = 0;; shift += 3) {
      const std::uint32_t read = nibble();
      // Ten digits hold more than any length or difference.
      if (shift > 27) throw std::invalid_argument("RVL: a number of more than ten digits");
      value |= (read & kDigit) << shift;
      if (!(read & kMore)) return value;
    }
  }

 private:
  std::uint32_t nibble() {
    if (left_ == 0) {
      if (bytes_ - at_ < 4) throw std::invalid_argument("RVL: the data end early");
      word_ = 0;
      for (int k = 0; k < 4; ++k) word_ |= std::uint32_t(data_[at_ + static_cast<std::size_t>(k)]) << 8 * k;
      at_ += 4;
      left_ = kNibblesInWord;
    }
    --left_;
    return word_ >> 4 * left_ & 15;
  }

  const std::uint8_t* data_;
  std::size_t bytes_, at_ = 0;
  std::uint32_t word_ = 0;
  int left_ = 0;
};

}  // namespace

std::vector<std::uint8_t> encodeRvl(const cv::Mat& depth) {
  if (depth.type() != CV_16UC1) throw std::invalid_argument("RVL: expected a 16-bit depth image");
  const cv::Mat image = depth.isContinuous() ? depth : depth.clone();
  const std::uint16_t *at = image.ptr<std::uint16_t>(), *const end = at + image.total();
  Writer out;
  int before = 0;
  while (at != end) {
    const std::uint16_t* const zeros = at;
    while (at != end && *at == 0) ++at;
    const std::uint16_t* const values = at;
    while (at != end && *at != 0) ++at;
    out.number(static_cast<std::uint32_t>(values - zeros));
    out.number(static_cast<std::uint32_t>(at - values));
    for (const std::uint16_t* value = values; value != at; ++value) {
      const int step = *value - before;
      out.number(step < 0 ? static_cast<std::uint32_t>(-2 * step - 1) : static_cast<std::uint32_t>(2 * step));
      before = *value;
    }
  }
  return out.finish();
}

cv::Mat decodeRvl(const std::uint8_t* data, std::size_t bytes, const cv::Size& size) {
  if (size.width <= 0 || size.height <= 0)
    throw std::invalid_argument("RVL: an image of " + sizeText(size) + ", expected pixels");
  cv::Mat depth = cv::Mat::zeros(size, CV_16UC1);
  std::uint16_t* at = depth.ptr<std::uint16_t>();
  std::size_t left = depth.total();
  Reader in(data, bytes);
  const auto run = [&] {
    const std::uint32_t length = in.number();
    if (length > left)
      throw std::invalid_argument("RVL: a run of " + std::to_string(length) + " pixels, where " + std::to_string(left) +
                                  " are left of " + sizeText(size));
    left -= length;
    return length;
  };
  std::uint32_t value = 0;
  while (left > 0) {
    at += run();
    for (std::uint32_t k = run(); k > 0; --k) {
      const std::uint32_t code = in.number();
      value += code >> 1 ^ (code & 1 ? ~0u : 0u);
      *at++ = static_cast<std::uint16_t>(value);
    }
  }
  return depth;
}

}  // namespace vip_slam
