// SPDX-License-Identifier: BSD-3-Clause
// libFuzzer target: whatever the bytes, reading a vocabulary (binary, or text when the first byte is a digit) gives a
// vocabulary that can be used or a std::runtime_error.
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>

#include "vip_slam_backend/place_recognition/vocabulary_io.h"
#include "vip_slam_backend/util/crc32.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string bytes(reinterpret_cast<const char*>(data), size);
  try {
    vip_slam::Vocabulary vocabulary;
    if (size > 0 && data[0] >= '0' && data[0] <= '9') {
      vocabulary = vip_slam::parseTextVocabulary(bytes, "fuzz");
    } else {
      if (size >= 8) {
        const std::uint32_t crc = vip_slam::crc32(bytes.data(), size - 4);
        std::memcpy(&bytes[size - 4], &crc, 4);
      }
      vocabulary = vip_slam::parseVocabulary(reinterpret_cast<const std::uint8_t*>(bytes.data()), size, "fuzz");
      if (vip_slam::serialiseVocabulary(vocabulary) != bytes) std::abort();
    }
    vip_slam::Descriptor descriptor{};
    if (vocabulary.word(descriptor) >= vocabulary.words()) std::abort();
  } catch (const std::runtime_error&) {
  }
  return 0;
}
