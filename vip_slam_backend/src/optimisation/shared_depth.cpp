// SPDX-License-Identifier: BSD-3-Clause
#include "shared_depth.h"

#include <algorithm>
#include <cmath>

namespace vip_slam {
namespace {

// Readings of one surface: within this angle of each other, and by so much of their depth.
constexpr double kNearAngle = 0.1, kSameDepth = 0.05;

/// Per depth observation the number of those in the same frame near it, itself included.
std::vector<double> neighbours(const BaProblem& problem) {
  std::vector<std::vector<std::size_t>> of_frame(problem.frames.size());
  for (std::size_t k = 0; k < problem.observations.size(); ++k)
    if (problem.observations[k].depth_weight > 0) of_frame[problem.observations[k].frame].push_back(k);
  std::vector<double> count(problem.observations.size(), 1);
  for (std::vector<std::size_t>& list : of_frame) {
    std::sort(list.begin(), list.end(), [&problem](std::size_t a, std::size_t b) {
      return problem.observations[a].x < problem.observations[b].x;
    });
    for (std::size_t i = 0; i < list.size(); ++i) {
      const BaObservation& a = problem.observations[list[i]];
      for (std::size_t j = i + 1; j < list.size(); ++j) {
        const BaObservation& b = problem.observations[list[j]];
        if (b.x - a.x > kNearAngle) break;
        if (std::abs(b.y - a.y) > kNearAngle || std::abs(b.depth - a.depth) > kSameDepth * a.depth) continue;
        ++count[list[i]];
        ++count[list[j]];
      }
    }
  }
  return count;
}

}  // namespace

void shareDepthErrors(const DepthNoise& model, const DepthNoiseParts& noise, const std::vector<double>& times,
                      BaProblem* problem) {
  const std::vector<double> beside = neighbours(*problem);
  for (const BaPoint& point : problem->points) {
    for (int i = point.first; i < point.first + point.count; ++i) {
      BaObservation& observation = problem->observations[i];
      if (!(observation.depth_weight > 0)) continue;
      double together = 0;
      for (int j = point.first; j < point.first + point.count; ++j) {
        const BaObservation& other = problem->observations[j];
        if (other.depth_weight > 0) together += sharedDepth(times[other.frame] - times[observation.frame]);
      }
      const double shared = model.sigma(observation.depth), white = 1 / observation.depth_weight;
      observation.depth_weight = 1 / std::sqrt(white * white + noise.shared * beside[i] * together * shared * shared);
    }
  }
}

}  // namespace vip_slam
