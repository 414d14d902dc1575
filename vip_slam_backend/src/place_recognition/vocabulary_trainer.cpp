// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/place_recognition/vocabulary_trainer.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <numeric>
#include <random>
#include <stdexcept>

#include "vip_slam_backend/map/map.h"
#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

using Indices = std::vector<std::uint32_t>;

// Bit-wise majority: the exact median under the Hamming distance.
Descriptor medianOf(const std::vector<Descriptor>& all, const Indices& members) {
  std::array<std::uint32_t, 256> ones{};
  for (const std::uint32_t m : members)
    for (int bit = 0; bit < 256; ++bit) ones[bit] += (all[m][bit >> 3] >> (bit & 7)) & 1;
  Descriptor median{};
  for (int bit = 0; bit < 256; ++bit)
    if (2 * ones[bit] > members.size()) median[bit >> 3] |= static_cast<std::uint8_t>(1 << (bit & 7));
  return median;
}

// k-means++ seeding: each further centre is drawn with probability proportional to the squared distance to the nearest.
std::vector<Descriptor> seedCentres(const std::vector<Descriptor>& all, const Indices& members, int k,
                                    std::mt19937_64& random) {
  std::vector<Descriptor> centres{all[members[random() % members.size()]]};
  std::vector<double> nearest(members.size(), std::numeric_limits<double>::max());
  while (static_cast<int>(centres.size()) < k) {
    double sum = 0;
    for (std::size_t m = 0; m < members.size(); ++m) {
      const double d = hammingDistance(all[members[m]], centres.back());
      nearest[m] = std::min(nearest[m], d * d);
      sum += nearest[m];
    }
    if (sum <= 0) break;  // fewer distinct descriptors than centres
    double at = sum * (static_cast<double>(random() >> 11) * 0x1.0p-53);
    std::size_t chosen = 0;
    while (chosen + 1 < members.size() && at >= nearest[chosen]) at -= nearest[chosen++];
    if (nearest[chosen] <= 0) break;
    centres.push_back(all[members[chosen]]);
  }
  return centres;
}

struct Clusters {
  std::vector<Descriptor> centres;
  std::vector<Indices> members;
};

Clusters kMedians(const std::vector<Descriptor>& all, const Indices& members, const VocabularyTrainerOptions& options,
                  std::mt19937_64& random) {
  Clusters c;
  c.centres = seedCentres(all, members, options.branching, random);
  std::vector<std::uint32_t> label(members.size(), std::numeric_limits<std::uint32_t>::max());
  for (int round = 0; round < options.iterations; ++round) {
    c.members.assign(c.centres.size(), {});
    bool changed = false;
    for (std::size_t m = 0; m < members.size(); ++m) {
      std::uint32_t best = 0;
      int best_distance = std::numeric_limits<int>::max();
      for (std::uint32_t k = 0; k < c.centres.size(); ++k) {
        const int d = hammingDistance(all[members[m]], c.centres[k]);
        if (d < best_distance) {
          best_distance = d;
          best = k;
        }
      }
      changed |= label[m] != best;
      label[m] = best;
      c.members[best].push_back(members[m]);
    }
    if (!changed) break;
    if (round + 1 == options.iterations) break;  // keep the centres that the clusters were assigned with
    for (std::size_t k = 0; k < c.centres.size(); ++k)
      if (!c.members[k].empty()) c.centres[k] = medianOf(all, c.members[k]);
  }
  for (std::size_t k = c.centres.size(); k-- > 0;)
    if (c.members[k].empty()) {
      c.centres.erase(c.centres.begin() + static_cast<std::ptrdiff_t>(k));
      c.members.erase(c.members.begin() + static_cast<std::ptrdiff_t>(k));
    }
  return c;
}

}  // namespace

Vocabulary trainVocabulary(const std::vector<std::vector<Descriptor>>& images, const VocabularyTrainerOptions& options,
                           const std::function<void(double)>& progress) {
  if (options.branching < 2 || options.branching > 255 || options.levels < 1 || options.levels > 10)
    throw std::invalid_argument(formatted("vocabulary: branching is %d and levels %d, expected 2 to 255 and 1 to 10",
                                          options.branching, options.levels));
  std::vector<Descriptor> all;
  for (const auto& image : images) all.insert(all.end(), image.begin(), image.end());
  if (all.size() < static_cast<std::size_t>(options.branching))
    throw std::invalid_argument(formatted("vocabulary: %zu descriptors are too few to train on, expected at least %d",
                                          all.size(), options.branching));

  struct Open {
    Indices members;
    int level;
  };
  Vocabulary::Tree tree;
  tree.branching = static_cast<std::uint32_t>(options.branching);
  tree.levels = static_cast<std::uint32_t>(options.levels);
  tree.descriptors.push_back({});
  std::deque<Open> open;
  open.push_back({Indices(all.size()), 0});
  std::iota(open.front().members.begin(), open.front().members.end(), 0u);
  std::mt19937_64 random(options.seed);
  double done = 0;
  // Breadth first: nodes are appended in the order in which the tree stores them.
  while (!open.empty()) {
    Open node = std::move(open.front());
    open.pop_front();
    const double node_size = static_cast<double>(node.members.size());
    const bool split = node.level == 0 || (node.level < options.levels &&
                                           node.members.size() >= static_cast<std::size_t>(options.min_descriptors));
    Clusters clusters;
    if (split) clusters = kMedians(all, node.members, options, random);
    if (clusters.centres.size() < 2 && node.level > 0) clusters = {};
    tree.children.push_back(static_cast<std::uint8_t>(clusters.centres.size()));
    for (std::size_t k = 0; k < clusters.centres.size(); ++k) {
      tree.descriptors.push_back(clusters.centres[k]);
      open.push_back({std::move(clusters.members[k]), node.level + 1});
    }
    if (clusters.centres.empty()) done += node_size;
    if (progress) progress(done / static_cast<double>(all.size()));
  }

  tree.weights.assign(static_cast<std::size_t>(std::count(tree.children.begin(), tree.children.end(), 0)), 1.f);
  const Vocabulary unweighted(tree);
  std::vector<std::uint32_t> seen_in(tree.weights.size(), 0);
  for (const auto& image : images) {
    std::vector<WordId> words;
    for (const Descriptor& d : image) words.push_back(unweighted.word(d));
    std::sort(words.begin(), words.end());
    words.erase(std::unique(words.begin(), words.end()), words.end());
    for (const WordId w : words) ++seen_in[w];
  }
  for (std::size_t w = 0; w < seen_in.size(); ++w)
    tree.weights[w] =
        static_cast<float>(std::log((1.0 + static_cast<double>(images.size())) / std::max(1u, seen_in[w])));
  return Vocabulary(std::move(tree));
}

}  // namespace vip_slam
