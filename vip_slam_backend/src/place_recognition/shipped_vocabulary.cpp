// SPDX-License-Identifier: BSD-3-Clause
// The shipped vocabulary is linked into the library (shipped_vocabulary.S), so that it does not depend on search paths.
#include <memory>

#include "vip_slam_backend/place_recognition/vocabulary_io.h"

extern "C" {
extern const std::uint8_t vip_slam_shipped_vocabulary_begin[];
extern const std::uint8_t vip_slam_shipped_vocabulary_end[];
}

namespace vip_slam {

std::shared_ptr<const Vocabulary> shippedVocabulary() {
  static const auto vocabulary = std::make_shared<const Vocabulary>(
      parseVocabulary(vip_slam_shipped_vocabulary_begin,
                      static_cast<std::size_t>(vip_slam_shipped_vocabulary_end - vip_slam_shipped_vocabulary_begin),
                      "shipped vocabulary"));
  return vocabulary;
}

std::shared_ptr<const Vocabulary> openVocabulary(const std::string& path) {
  return path.empty() ? shippedVocabulary() : std::make_shared<const Vocabulary>(loadVocabulary(path));
}

}  // namespace vip_slam
