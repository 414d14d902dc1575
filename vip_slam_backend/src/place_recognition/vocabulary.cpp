// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/place_recognition/vocabulary.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>

#include "vip_slam_backend/map/map.h"

namespace vip_slam {
namespace {

constexpr WordId kNoWord = std::numeric_limits<WordId>::max();

class Fnv {
 public:
  void add(const void* data, std::size_t size) {
    const auto* bytes = static_cast<const std::uint8_t*>(data);
    for (std::size_t k = 0; k < size; ++k) hash_ = (hash_ ^ bytes[k]) * 1099511628211ull;
  }
  std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 14695981039346656037ull;
};

}  // namespace

Vocabulary::Vocabulary(Tree tree) : tree_(std::move(tree)) {
  const std::size_t n = tree_.children.size();
  const auto fail = [](const std::string& what) { throw std::invalid_argument("vocabulary tree: " + what); };
  if (n < 2) fail("has no words");
  if (tree_.descriptors.size() != n)
    fail(std::to_string(n) + " nodes but " + std::to_string(tree_.descriptors.size()) + " descriptors");
  first_child_.resize(n);
  word_of_node_.assign(n, kNoWord);
  std::size_t next = 1;
  for (std::size_t k = 0; k < n; ++k) {
    if (k >= next) fail("node " + std::to_string(k) + " is nobody's child");
    first_child_[k] = static_cast<std::uint32_t>(next);
    if (tree_.children[k] == 0) word_of_node_[k] = static_cast<WordId>(word_count_++);
    next += tree_.children[k];
    if (next > n) fail("node " + std::to_string(k) + " has children beyond the last node");
  }
  if (tree_.weights.size() != word_count_)
    fail(std::to_string(word_count_) + " words but " + std::to_string(tree_.weights.size()) + " weights");
  for (std::size_t k = 0; k < word_count_; ++k)
    if (!std::isfinite(tree_.weights[k]) || tree_.weights[k] < 0)
      fail("weight of word " + std::to_string(k) + " is not a number >= 0");
  Fnv hash;
  hash.add(tree_.children.data(), n);
  hash.add(tree_.descriptors.data(), n * sizeof(Descriptor));
  hash.add(tree_.weights.data(), word_count_ * sizeof(float));
  id_ = hash.value();
}

std::uint32_t Vocabulary::descend(const Descriptor& descriptor, int direct_level, std::uint32_t* direct_node) const {
  std::uint32_t node = 0;
  int level = 0;
  if (direct_node) *direct_node = 0;
  while (tree_.children[node] > 0) {
    const std::uint32_t begin = first_child_[node], end = begin + tree_.children[node];
    int best = std::numeric_limits<int>::max();
    for (std::uint32_t child = begin; child < end; ++child) {
      const int distance = hammingDistance(descriptor, tree_.descriptors[child]);
      if (distance < best) {
        best = distance;
        node = child;
      }
    }
    if (direct_node && ++level <= direct_level) *direct_node = node;
  }
  return node;
}

WordId Vocabulary::word(const Descriptor& descriptor) const {
  if (empty()) throw std::logic_error("vocabulary is empty");
  return word_of_node_[descend(descriptor, 0, nullptr)];
}

BowResult Vocabulary::transform(const std::vector<Descriptor>& descriptors, int direct_level) const {
  BowResult result;
  if (empty()) return result;
  std::map<WordId, std::uint32_t> frequency;
  std::map<std::uint32_t, std::vector<std::uint32_t>> direct;
  for (std::size_t k = 0; k < descriptors.size(); ++k) {
    std::uint32_t node = 0;
    ++frequency[word_of_node_[descend(descriptors[k], direct_level, &node)]];
    direct[node].push_back(static_cast<std::uint32_t>(k));
  }
  double sum = 0;
  for (const auto& entry : frequency) sum += entry.second * static_cast<double>(tree_.weights[entry.first]);
  if (sum > 0) {
    result.bow.reserve(frequency.size());
    for (const auto& entry : frequency) {
      const double weight = entry.second * static_cast<double>(tree_.weights[entry.first]) / sum;
      if (weight > 0) result.bow.emplace_back(entry.first, static_cast<float>(weight));
    }
  }
  result.direct.assign(std::make_move_iterator(direct.begin()), std::make_move_iterator(direct.end()));
  return result;
}

double bowScore(const BowVector& a, const BowVector& b) {
  double common = 0;
  for (auto i = a.begin(), j = b.begin(); i != a.end() && j != b.end();) {
    if (i->first < j->first) {
      ++i;
    } else if (j->first < i->first) {
      ++j;
    } else {
      // With both norms 1, 1 - |a-b|/2 is the sum of the smaller weights of the common words.
      common += std::min(i->second, j->second);
      ++i;
      ++j;
    }
  }
  return common;
}

}  // namespace vip_slam
