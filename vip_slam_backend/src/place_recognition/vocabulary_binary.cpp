// SPDX-License-Identifier: BSD-3-Clause
// The compact binary vocabulary format.
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "vip_slam_backend/place_recognition/vocabulary_io.h"
#include "vip_slam_backend/util/crc32.h"
#include "vip_slam_core/util/atomic_file.h"

namespace vip_slam {
namespace {

constexpr char kMagic[8] = {'V', 'I', 'P', 'V', 'O', 'C', 0, 0};
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHeader = 8 + 5 * 4;

std::uint32_t readU32(const std::uint8_t* p) {
  return p[0] | p[1] << 8 | p[2] << 16 | static_cast<std::uint32_t>(p[3]) << 24;
}

void putU32(std::string& out, std::uint32_t v) {
  for (int k = 0; k < 4; ++k) out.push_back(static_cast<char>(v >> (8 * k)));
}

[[noreturn]] void fail(const std::string& source, const std::string& what) {
  throw std::runtime_error(source + ": " + what);
}

}  // namespace

Vocabulary parseVocabulary(const std::uint8_t* data, std::size_t size, const std::string& source) {
  if (size < kHeader + 4) fail(source, "too short for a vocabulary (" + std::to_string(size) + " bytes)");
  if (std::memcmp(data, kMagic, 8) != 0) fail(source, "not a vocabulary file, expected it to start with VIPVOC");
  const std::uint32_t version = readU32(data + 8);
  if (version != kVersion)
    fail(source, "vocabulary version " + std::to_string(version) + ", expected " + std::to_string(kVersion));
  const std::size_t nodes = readU32(data + 20), words = readU32(data + 24);
  // 64-bit sizes cannot overflow from 32-bit counts; nothing is allocated before the length is known to match.
  const std::uint64_t expected =
      kHeader + std::uint64_t(nodes) + 32 * (nodes ? std::uint64_t(nodes) - 1 : 0) + 4 * std::uint64_t(words) + 4;
  if (nodes < 2 || size != expected)
    fail(source, "vocabulary of " + std::to_string(size) + " bytes, expected " + std::to_string(expected) + " for " +
                     std::to_string(nodes) + " nodes and " + std::to_string(words) + " words (truncated?)");
  if (crc32(data, size - 4) != readU32(data + size - 4)) fail(source, "checksum of the vocabulary is wrong (damaged)");

  Vocabulary::Tree tree;
  tree.branching = readU32(data + 12);
  tree.levels = readU32(data + 16);
  const std::uint8_t* p = data + kHeader;
  tree.children.assign(p, p + nodes);
  p += nodes;
  tree.descriptors.resize(nodes);
  tree.descriptors[0].fill(0);
  std::memcpy(tree.descriptors.data() + 1, p, 32 * (nodes - 1));
  p += 32 * (nodes - 1);
  tree.weights.resize(words);
  for (std::size_t k = 0; k < words; ++k, p += 4) {
    const std::uint32_t bits = readU32(p);
    std::memcpy(&tree.weights[k], &bits, 4);
  }
  try {
    return Vocabulary(std::move(tree));
  } catch (const std::invalid_argument& e) {
    fail(source, e.what());
  }
}

std::string serialiseVocabulary(const Vocabulary& vocabulary) {
  const Vocabulary::Tree& tree = vocabulary.tree();
  if (vocabulary.empty()) throw std::invalid_argument("an empty vocabulary cannot be written");
  std::string out(kMagic, 8);
  putU32(out, kVersion);
  putU32(out, tree.branching);
  putU32(out, tree.levels);
  putU32(out, static_cast<std::uint32_t>(tree.children.size()));
  putU32(out, static_cast<std::uint32_t>(tree.weights.size()));
  out.append(reinterpret_cast<const char*>(tree.children.data()), tree.children.size());
  out.append(reinterpret_cast<const char*>(tree.descriptors.data() + 1), 32 * (tree.descriptors.size() - 1));
  for (const float weight : tree.weights) {
    std::uint32_t bits;
    std::memcpy(&bits, &weight, 4);
    putU32(out, bits);
  }
  putU32(out, crc32(out.data(), out.size()));
  return out;
}

void saveVocabulary(const Vocabulary& vocabulary, const std::string& path) {
  const std::string bytes = serialiseVocabulary(vocabulary);
  AtomicFile file(path, true);
  file.stream().write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.commit();
}

Vocabulary loadVocabulary(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) fail(path, "cannot be opened, expected a vocabulary file");
  const std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (in.bad()) fail(path, "cannot be read");
  // A text vocabulary starts with the branching factor.
  if (!bytes.empty() && bytes[0] >= '0' && bytes[0] <= '9') return parseTextVocabulary(bytes, path);
  return parseVocabulary(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(), path);
}

}  // namespace vip_slam
