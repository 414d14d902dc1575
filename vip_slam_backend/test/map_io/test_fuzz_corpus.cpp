// SPDX-License-Identifier: BSD-3-Clause
// Inputs found by fuzzing, read in every test run: each gives a consistent map or a clear error.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "vip_slam_backend/map/map_checker.h"
#include "vip_slam_backend/map_io/map_file.h"
#include "vip_slam_backend/place_recognition/vocabulary_io.h"
#include "vip_slam_backend/util/crc32.h"

namespace vip_slam {
namespace {

std::vector<std::string> corpus(const std::string& reader) {
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(std::string(VIP_SLAM_FUZZ_CORPUS) + "/" + reader)) {
    std::ifstream in(entry.path(), std::ios::binary);
    files.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  }
  return files;
}

void seal(std::string* bytes) {
  if (bytes->size() < 8) return;
  const std::uint32_t crc = crc32(bytes->data(), bytes->size() - 4);
  std::memcpy(&(*bytes)[bytes->size() - 4], &crc, 4);
}

TEST(FuzzCorpus, Maps) {
  const auto files = corpus("map");
  ASSERT_FALSE(files.empty());
  std::size_t good = 0;
  for (std::string bytes : files) {
    if (bytes.size() >= 28) {
      const std::uint64_t length = bytes.size() - 28;
      std::memcpy(&bytes[16], &length, 8);
    }
    seal(&bytes);
    try {
      EXPECT_EQ(
          checkMap(
              parseMap(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(), "corpus", ImuNoise()).map),
          "");
      ++good;
    } catch (const std::runtime_error& e) {
      EXPECT_EQ(std::string(e.what()).rfind("corpus: ", 0), 0u) << e.what();
    }
  }
  EXPECT_GT(good, 0u);
}

TEST(FuzzCorpus, Vocabularies) {
  const auto files = corpus("vocabulary");
  ASSERT_FALSE(files.empty());
  std::size_t good = 0;
  for (std::string bytes : files) {
    try {
      if (!bytes.empty() && bytes[0] >= '0' && bytes[0] <= '9') {
        parseTextVocabulary(bytes, "corpus");
      } else {
        seal(&bytes);
        parseVocabulary(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(), "corpus");
      }
      ++good;
    } catch (const std::runtime_error& e) {
      EXPECT_EQ(std::string(e.what()).rfind("corpus:", 0), 0u) << e.what();
    }
  }
  EXPECT_GT(good, 0u);
}

}  // namespace
}  // namespace vip_slam
