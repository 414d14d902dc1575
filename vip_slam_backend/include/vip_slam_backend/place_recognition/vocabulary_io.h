// SPDX-License-Identifier: BSD-3-Clause
// Vocabulary files: our compact binary format, and the text format of ORB-SLAM (DBoW2's saveToTextFile).
//
// Binary, little-endian: "VIPVOC" 0 0 | u32 version = 1 | u32 branching | u32 levels | u32 nodes | u32 words |
// u8 children[nodes] | 32-byte descriptor[nodes - 1] (no root) | f32 idf[words] | u32 CRC-32 of all before it.
#pragma once

#include <memory>
#include <string>

#include "vip_slam_backend/place_recognition/vocabulary.h"

namespace vip_slam {

/// Reads either format (told by its first bytes). Throws std::runtime_error "file: what, expected what".
Vocabulary loadVocabulary(const std::string& path);
/// The binary format from memory; `source` names it in errors.
Vocabulary parseVocabulary(const std::uint8_t* data, std::size_t size, const std::string& source);
/// The text format: "k L scoring weighting", then per node "parent is_leaf 32 bytes weight".
Vocabulary parseTextVocabulary(const std::string& text, const std::string& source);
std::string serialiseVocabulary(const Vocabulary& vocabulary);
/// Whole or not at all. Throws std::runtime_error naming the path.
void saveVocabulary(const Vocabulary& vocabulary, const std::string& path);

/// The vocabulary shipped with the package (it is part of the library); parsed once.
std::shared_ptr<const Vocabulary> shippedVocabulary();
/// `path` empty: the shipped one.
std::shared_ptr<const Vocabulary> openVocabulary(const std::string& path);

}  // namespace vip_slam
