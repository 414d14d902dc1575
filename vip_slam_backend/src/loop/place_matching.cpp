// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/loop/place_matching.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "vip_slam_backend/map/map.h"

namespace vip_slam {
namespace {

constexpr int kAngleBins = 24;

int angleBin(const Feature& a, const Feature& b) {
  const double turns = (static_cast<double>(a.angle) - b.angle) / (2.0 * M_PI);
  const int bin = static_cast<int>(std::floor((turns - std::floor(turns)) * kAngleBins));
  return std::min(bin, kAngleBins - 1);
}

// Keeps matches in the fullest bin and its two neighbours: the camera's roll is the same for all true matches.
void keepCommonAngle(const std::vector<Feature>& a, const std::vector<Feature>& b,
                     std::vector<std::pair<std::uint32_t, std::uint32_t>>& matches) {
  std::array<int, kAngleBins> count{};
  for (const auto& m : matches) ++count[angleBin(a[m.first], b[m.second])];
  const auto window = [&count](int k) {
    return count[k] + count[(k + 1) % kAngleBins] + count[(k + kAngleBins - 1) % kAngleBins];
  };
  int best = 0;
  for (int k = 1; k < kAngleBins; ++k)
    if (window(k) > window(best)) best = k;
  matches.erase(std::remove_if(matches.begin(), matches.end(),
                               [&](const auto& m) {
                                 const int off = std::abs(angleBin(a[m.first], b[m.second]) - best);
                                 return std::min(off, kAngleBins - off) > 1;
                               }),
                matches.end());
}

}  // namespace

std::vector<std::pair<std::uint32_t, std::uint32_t>> matchByDirectIndex(const std::vector<Feature>& a,
                                                                        const DirectIndex& index_a,
                                                                        const std::vector<Feature>& b,
                                                                        const DirectIndex& index_b,
                                                                        const PlaceVerificationOptions& options) {
  struct Best {
    std::uint32_t a = 0;
    int distance = std::numeric_limits<int>::max();
  };
  std::vector<Best> taken(b.size());
  for (auto i = index_a.begin(), j = index_b.begin(); i != index_a.end() && j != index_b.end();) {
    if (i->first < j->first) {
      ++i;
      continue;
    }
    if (j->first < i->first) {
      ++j;
      continue;
    }
    for (const std::uint32_t fa : i->second) {
      int best = std::numeric_limits<int>::max(), second = best;
      std::uint32_t best_b = 0;
      for (const std::uint32_t fb : j->second) {
        const int distance = hammingDistance(a[fa].descriptor, b[fb].descriptor);
        if (distance < best) {
          second = best;
          best = distance;
          best_b = fb;
        } else if (distance < second) {
          second = distance;
        }
      }
      if (best > options.max_hamming || best > options.ratio * second) continue;
      if (best < taken[best_b].distance) taken[best_b] = {fa, best};
    }
    ++i;
    ++j;
  }
  std::vector<std::pair<std::uint32_t, std::uint32_t>> matches;
  for (std::uint32_t fb = 0; fb < taken.size(); ++fb)
    if (taken[fb].distance <= options.max_hamming) matches.emplace_back(taken[fb].a, fb);
  keepCommonAngle(a, b, matches);
  std::sort(matches.begin(), matches.end());
  return matches;
}

}  // namespace vip_slam
