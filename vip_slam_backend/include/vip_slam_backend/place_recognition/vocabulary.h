// SPDX-License-Identifier: BSD-3-Clause
// A hierarchical binary vocabulary in the DBoW2 scheme (Galvez-Lopez & Tardos 2012): a tree of k-medians over ORB
// descriptors whose leaves are visual words weighted by their inverse document frequency.
// An image becomes a sparse tf-idf vector of L1 norm 1 (BowVector) and a direct index from tree nodes to its features.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "vip_slam_core/types/feature.h"

namespace vip_slam {

using WordId = std::uint32_t;
/// (word, weight), ascending word; weights sum to 1, or empty.
using BowVector = std::vector<std::pair<WordId, float>>;
/// (node, indices of the descriptors below it), ascending node and index.
using DirectIndex = std::vector<std::pair<std::uint32_t, std::vector<std::uint32_t>>>;

struct BowResult {
  BowVector bow;
  DirectIndex direct;
};

class Vocabulary {
 public:
  /// Nodes in breadth-first order; node 0 is the root. The children of a node are consecutive.
  struct Tree {
    std::uint32_t branching = 0, levels = 0;
    std::vector<std::uint8_t> children;   ///< count per node; 0: a word
    std::vector<Descriptor> descriptors;  ///< per node; the root's is unused (zero)
    std::vector<float> weights;           ///< idf per word, in the order of its leaves
  };

  Vocabulary() = default;
  /// Throws std::invalid_argument naming what is wrong when the tree is not well formed.
  explicit Vocabulary(Tree tree);

  bool empty() const { return word_count_ == 0; }
  std::size_t words() const { return word_count_; }
  /// Checksum of the content; map files name it, for those who wonder later.
  std::uint64_t id() const { return id_; }
  const Tree& tree() const { return tree_; }

  WordId word(const Descriptor& descriptor) const;
  float weight(WordId word) const { return tree_.weights[word]; }
  /// `direct_level`: tree level whose nodes group the features for matching (1 = below the root).
  BowResult transform(const std::vector<Descriptor>& descriptors, int direct_level = 2) const;

 private:
  std::uint32_t descend(const Descriptor& descriptor, int direct_level, std::uint32_t* direct_node) const;

  Tree tree_;
  std::vector<std::uint32_t> first_child_;
  std::vector<WordId> word_of_node_;
  std::size_t word_count_ = 0;
  std::uint64_t id_ = 0;
};

/// L1 score of two normalised vectors in [0, 1]: 1 - 0.5 |a - b|_1.
double bowScore(const BowVector& a, const BowVector& b);

}  // namespace vip_slam
