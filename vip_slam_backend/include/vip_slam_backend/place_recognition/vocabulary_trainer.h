// SPDX-License-Identifier: BSD-3-Clause
// Trains a vocabulary: hierarchical k-medians over binary descriptors (the median of a cluster is the majority of each
// bit), idf from the number of images that contain a word.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "vip_slam_backend/place_recognition/vocabulary.h"

namespace vip_slam {

struct VocabularyTrainerOptions {
  int branching = 10;       ///< children per node, 2..255
  int levels = 5;           ///< depth of the tree
  int iterations = 12;      ///< k-medians rounds per node
  int min_descriptors = 8;  ///< a node with fewer is not split, since its words would not generalise
  std::uint64_t seed = 1;
};

/// One list of descriptors per image. `progress(fraction)` may be empty. Same input and seed give the same tree.
/// Throws std::invalid_argument when there is nothing to train on.
Vocabulary trainVocabulary(const std::vector<std::vector<Descriptor>>& images, const VocabularyTrainerOptions& options,
                           const std::function<void(double)>& progress = {});

}  // namespace vip_slam
